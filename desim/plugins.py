"""From a name in a scenario to a class: entry points, or a dotted path that the user writes."""

from __future__ import annotations

import importlib
import os
import sys
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from inspect import getattr_static
from operator import attrgetter
from typing import Any

from desim import ports
from desim.errors import InputError, did_you_mean

GROUPS = {
    "network": "desim.networks",
    "rule": "desim.rules",
    "strategy": "desim.strategies",
    "middleware": "desim.middleware",
    "world": "desim.worlds",
    "case": "desim.cases",
    "validation": "desim.validation",
}

CONTRACTS = {
    "network": ports.NetworkModel,
    "rule": ports.Rule,
    "strategy": ports.Strategy,
    "middleware": ports.Middleware,
    "world": ports.World,
}


@cache
def available(kind: str) -> dict[str, EntryPoint]:
    """Name to entry point for one of the kinds in ``GROUPS``, sorted by name."""
    return dict(sorted((point.name, point) for point in entry_points(group=GROUPS[kind])))


@cache
def load(kind: str, name: str) -> Any:
    """The class called ``name``: an entry point's name or ``package.module:Class``.

    Raises ``InputError`` that says what is known, why the import failed, or which methods of its
    contract the class lacks.
    """
    cls = imported(kind, name if ":" in name else _installed(kind, name))
    missing = _missing(CONTRACTS[kind], cls) if kind in CONTRACTS else []
    if missing:
        raise InputError(f"the {kind} {name!r} has no {', '.join(missing)}: it is not a plug-in "
                         "for this place; wanted: a class with all methods of "
                         f"desim.ports.{CONTRACTS[kind].__name__}")
    return cls


def _installed(kind: str, name: str) -> str:
    points = available(kind)
    if name not in points:
        raise InputError(f"unknown {kind} {name!r}{did_you_mean(name, points)}; known: "
                         f"{', '.join(points) or 'none'}, or a dotted path 'package.module:Class'")
    return f"{points[name].module}:{points[name].attr}"


def _missing(contract: Any, cls: Any) -> list[str]:
    """The methods of a contract that a class has not, or only inherits from the contract."""
    stubs = {name: stub for name, stub in vars(contract).items()
             if not name.startswith("_") and callable(getattr(contract, name))}
    return [f"{name}()" for name, stub in stubs.items() if getattr_static(cls, name, stub) is stub]


def parameters(kind: str, name: str) -> type[ports.Params]:
    """The parameter block of the plug-in called ``name``. Raises ``InputError``."""
    block = getattr(load(kind, name), "Params", None)
    if not (isinstance(block, type) and issubclass(block, ports.Params)):
        raise InputError(f"the {kind} {name!r} has no class Params, a desim.ports.Params: it is "
                         "not a plug-in for this place")
    return block


def imported(kind: str, path: str) -> Any:
    """What ``package.module:name`` names; modules are also looked for in the current directory.

    Raises ``InputError`` that says why there is no such thing.
    """
    module, _, attribute = path.partition(":")
    if os.getcwd() not in sys.path:
        sys.path.append(os.getcwd())  # at the end: it shadows nothing
    try:
        return attrgetter(attribute)(importlib.import_module(module))
    except Exception as error:  # a stranger's module may fail in any way
        raise InputError(f"cannot load {kind} {path!r}: {error}") from error


def reference(kind: str, name: str, cls: Any) -> str:
    """``package.module:Class``, with its distribution and version where it has one: what a run's
    identity records of a plug-in."""
    point = available(kind).get(name)
    distribution = point.dist if point is not None else None
    version = f" ({distribution.name} {distribution.version})" if distribution else ""
    return f"{cls.__module__}:{cls.__qualname__}{version}"
