"""What a run's results depend on beside its scenario: versions, plug-ins, the machine."""

from __future__ import annotations

import hashlib
import os
import platform
import sys
import zlib
from collections.abc import Callable
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import desim
from desim import plugins
from desim.scenario.resolved import scenario_id
from desim.scenario.schema import Scenario

# What computes results. Others (pyarrow, rich, typer, ...) only carry them.
PACKAGES = ("desim", "numpy", "numba", "llvmlite", "simpy", "scipy", "networkx", "pydantic")

# What only shows results, or decides which runs are made: folders and files of desim.
_SHOWS = frozenset({"report", "campaign", "statistics", "commands", "cli.py"})


class Identity:
    """What names the runs of a scenario, whatever their seed. ``hashed``: the hash of the source,
    for whoever asks for thousands of identities at one time, and has looked at the files once."""

    def __init__(self, scenario: Scenario,
                 hashed: Callable[[tuple[str, ...]], str] | None = None) -> None:
        self.plugins = plugin_references(scenario)
        self.source = (hashed or source)(modules(scenario))
        self._run_id = scenario_id(scenario, {**versions(), **self.plugins,
                                              "source": self.source})

    def run_id(self, seed: int) -> str:
        """12 hex digits."""
        return self._run_id(seed)


@cache
def versions() -> dict[str, str]:
    """Python's version and those of ``PACKAGES``."""
    return {"python": platform.python_version(),
            **{name: metadata.version(name) for name in PACKAGES}}


def plugin_references(scenario: Scenario) -> dict[str, str]:
    """Every plug-in that the scenario names: kind and name (wherever its module lies) to class and
    version."""
    return {f"{kind} {plugins.bare(name)}": plugins.reference(kind, name, plugins.load(kind, name))
            for kind, name in _chosen(scenario)}


def _chosen(scenario: Scenario) -> list[tuple[str, str]]:
    chosen = {("strategy", scenario.coordination.strategy), ("world", scenario.physics.model),
              ("middleware", scenario.middleware.model)}
    for medium in scenario.network.media.values():
        chosen.add(("network", medium.model))
        chosen.update(("rule", rule.rule) for rule in medium.rules)
    return sorted(chosen)


def modules(scenario: Scenario) -> tuple[str, ...]:
    """Those of the scenario's plug-ins."""
    return tuple(sorted({plugins.load(kind, name).__module__ for kind, name in _chosen(scenario)}))


def source(modules: tuple[str, ...]) -> str:
    """A hash of the Python source of desim (but for what has no part in a run) and of the packages
    that plug-ins come from: during development the version stays the same."""
    digest = hashlib.sha256()
    for file in _files(modules):
        facts = os.stat(file)
        digest.update(_hash(file, facts.st_mtime_ns, facts.st_size))
    return digest.hexdigest()[:12]


# What is imported stays imported: a process looks for the files of a package once, and reads a
# file again only where it was written to.


@cache
def _files(modules: tuple[str, ...]) -> tuple[str, ...]:
    """Whose content may be in results: of desim and of these modules' packages, in an order that
    does not depend on where they are installed."""
    files = [file for file in _package(Path(desim.__file__).parent)
             if file.relative_to(Path(desim.__file__).parent).parts[0] not in _SHOWS]
    for top in sorted({module.partition(".")[0] for module in modules} - {desim.__name__}):
        place = sys.modules[top].__file__
        if place is not None:
            path = Path(place)
            files += _package(path.parent) if path.name == "__init__.py" else [path]
    return tuple(map(str, files))


@cache
def _package(folder: Path) -> tuple[Path, ...]:
    return tuple(sorted(folder.rglob("*.py")))


@cache
def _hash(file: str, _modified_ns: int, _size_bytes: int) -> bytes:
    return hashlib.sha256(Path(file).read_bytes()).digest()


@cache
def machine() -> dict[str, Any]:
    """What sin, cos, exp and log came from: the promise of equal digests ends with these."""
    import llvmlite.binding as llvm

    libc, version = platform.libc_ver()
    return {"platform": platform.platform(), "machine": platform.machine(),
            "cpu": llvm.get_host_cpu_name(), "libm": f"{libc} {version}".strip() or "unknown",
            "zlib": zlib.ZLIB_RUNTIME_VERSION,  # sizes of compressed maps reach the digest
            "llvm": ".".join(map(str, llvm.llvm_version_info))}
