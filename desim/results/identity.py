"""The identity of a run beside its scenario: versions, plug-ins, source code, the machine."""

from __future__ import annotations

import ast
import hashlib
import os
import platform
import sys
import sysconfig
import zlib
from collections.abc import Callable
from functools import cache
from importlib import metadata
from pathlib import Path

from desim import __version__ as desim_version
from desim import plugins
from desim.scenario import expression
from desim.scenario.plugin_choices import chosen
from desim.scenario.resolved import scenario_id
from desim.scenario.schema.scenario import Scenario

_DESIM = Path(__file__).parent.parent

# The packages that compute results. Others (pyarrow, rich, typer, ...) only carry them.
PACKAGES = ("desim", "numpy", "numba", "llvmlite", "simpy", "scipy", "networkx", "pydantic")

# Where code can change results or the files that hold them.
_COMPUTES = frozenset({"units.py", "errors.py", "files.py", "modules.py", "outside_yaml.py",
                       "plugins.py", "unpacking.py", "compiler",
                       "ports", "engine", "scenario", "world", "network", "computers", "middleware",
                       "robot", "monitor", "advice", "simulation", "results"})


class Identity:
    """The identity of the runs of a scenario: ``run_id(seed)`` gives 12 hex digits. ``hashed`` is
    ``source`` or a cache of it, for thousands of identities at one time."""

    def __init__(self, scenario: Scenario,
                 hashed: Callable[[tuple[str, ...]], str] | None = None) -> None:
        self.plugins = plugin_references(scenario)
        self.source = (hashed or source)(modules(scenario))
        self.run_id = scenario_id(scenario, {**versions(), **self.plugins, "source": self.source})


@cache
def versions() -> dict[str, str]:
    """Python's version and those of ``PACKAGES``."""
    return {"python": platform.python_version(),
            **{name: metadata.version(name) for name in PACKAGES},
            "desim": desim_version}


def plugin_references(scenario: Scenario) -> dict[str, str]:
    """Every plug-in that the scenario names: kind and name (wherever its module lies) to class and
    version."""
    return {f"{kind} {plugins.bare(name)}": plugins.reference(kind, name, plugins.load(kind, name))
            for kind, name in _chosen(scenario)}


def _chosen(scenario: Scenario) -> list[tuple[str, str]]:
    return sorted({("world", scenario.physics.model),
                   *((choice.kind, choice.plugin) for _, choice in chosen(scenario))})


def modules(scenario: Scenario) -> tuple[str, ...]:
    """The modules of the scenario's plug-ins, and of the function that ends it, if one does: those
    that define them, and those by which they are named."""
    found = {module for kind, name in _chosen(scenario)
             for module in (plugins.load(kind, name).__module__, plugins.module_of(kind, name))}
    when = scenario.stop.when
    if when and expression.names_function(when):
        found |= {plugins.imported("function", when.strip()).__module__,
                  plugins.module_of("function", when.strip())}
    return tuple(sorted(found & sys.modules.keys()))


def source(modules: tuple[str, ...]) -> str:
    """A hash of the Python source of desim (as far as it has a part in a run) and of the packages
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
    """The files whose code may affect results, in an order that does not depend on where they are
    installed: desim's, those of the modules' packages, and those that a module without a package
    imports from its own folder."""
    files = [file for file in _package(_DESIM) if file.relative_to(_DESIM).parts[0] in _COMPUTES]
    for top in sorted({module.partition(".")[0] for module in modules} - {_DESIM.name}):
        place = getattr(sys.modules[top], "__file__", None)
        if place is not None:
            path = Path(place)
            files += _package(path.parent) if path.name == "__init__.py" else _beside(path)
    return tuple(map(str, dict.fromkeys(files)))


def _beside(module: Path) -> list[Path]:
    """The module's file, then those that it imports from its own folder, and these in turn;
    packages there as a whole. What was installed stands by itself."""
    files, folder = {module: None}, module.parent
    if module.suffix != ".py" or str(folder) in sysconfig.get_paths().values():
        return list(files)
    agenda = [module]
    while agenda:
        for name in _imported(agenda.pop()):
            file, package = folder / f"{name}.py", folder / name / "__init__.py"
            if package.is_file() and name != _DESIM.name:
                files.update(dict.fromkeys(_package(package.parent)))
            elif file.is_file() and file not in files:
                files[file] = None
                agenda.append(file)
    return list(files)


def _imported(file: Path) -> list[str]:
    """The first part of each name that a file imports, wherever in it, sorted; none if it is not
    Python that runs here: then nobody has imported it, either."""
    try:
        nodes = list(ast.walk(ast.parse(file.read_bytes())))
    except (SyntaxError, ValueError):
        return []
    names = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    names += [node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module]
    return sorted({name.partition(".")[0] for name in names})


@cache
def _package(folder: Path) -> tuple[Path, ...]:
    return tuple(sorted(folder.rglob("*.py")))


@cache
def _hash(file: str, _modified_ns: int, _size_bytes: int) -> bytes:
    return hashlib.sha256(Path(file).read_bytes()).digest()


@cache
def machine() -> dict[str, str]:
    """The machine and its libraries, which sin, cos, exp and log come from: equal digests are
    promised for equal ones."""
    import llvmlite.binding as llvm

    libc, version = platform.libc_ver()
    return {"platform": platform.platform(), "machine": platform.machine(),
            "cpu": llvm.get_host_cpu_name(), "libm": f"{libc} {version}".strip() or "unknown",
            "zlib": zlib.ZLIB_RUNTIME_VERSION,  # sizes of compressed maps reach the digest
            "llvm": ".".join(map(str, llvm.llvm_version_info))}
