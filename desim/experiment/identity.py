"""What a run's results depend on beside its scenario: versions, plug-ins, the machine."""

from __future__ import annotations

import platform
from importlib import metadata
from typing import Any

from desim import plugins
from desim.scenario.schema import Scenario

# What computes results. Others (pyarrow, rich, typer, ...) only carry them.
PACKAGES = ("desim", "numpy", "numba", "llvmlite", "simpy", "scipy", "networkx", "pydantic")


def versions() -> dict[str, str]:
    """Python's version and those of ``PACKAGES``."""
    return {"python": platform.python_version(),
            **{name: metadata.version(name) for name in PACKAGES}}


def plugin_references(scenario: Scenario) -> dict[str, str]:
    """Every plug-in that the scenario names: kind and name to class and version."""
    chosen = {("strategy", scenario.coordination.strategy), ("world", scenario.physics.model),
              ("middleware", scenario.middleware.model)}
    for medium in scenario.network.media.values():
        chosen.add(("network", medium.model))
        chosen.update(("rule", rule.rule) for rule in medium.rules)
    return {f"{kind} {name}": plugins.reference(kind, name, plugins.load(kind, name))
            for kind, name in sorted(chosen)}


def machine() -> dict[str, Any]:
    """What sin, cos, exp and log came from: the promise of equal digests ends with these."""
    import llvmlite.binding as llvm

    libc, version = platform.libc_ver()
    return {"platform": platform.platform(), "machine": platform.machine(),
            "cpu": llvm.get_host_cpu_name(), "libm": f"{libc} {version}".strip() or "unknown",
            "llvm": ".".join(map(str, llvm.llvm_version_info))}
