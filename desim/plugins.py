"""From a name in a scenario to a class: entry points, or a dotted path that the user writes."""

from __future__ import annotations

import importlib
import os
import sys
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from operator import attrgetter
from typing import Any

from desim.errors import InputError, did_you_mean
from desim.ports import Params

GROUPS = {
    "network": "desim.networks",
    "rule": "desim.rules",
    "strategy": "desim.strategies",
    "middleware": "desim.middleware",
    "world": "desim.worlds",
    "case": "desim.cases",
    "validation": "desim.validation",
}


@cache
def available(kind: str) -> dict[str, EntryPoint]:
    """Name to entry point for one of the kinds in ``GROUPS``, sorted by name."""
    return dict(sorted((point.name, point) for point in entry_points(group=GROUPS[kind])))


@cache
def load(kind: str, name: str) -> Any:
    """The class called ``name``: an entry point's name or ``package.module:Class``.

    Raises ``InputError`` that says what is known, or why the import failed.
    """
    if ":" in name:
        return imported(kind, name)
    points = available(kind)
    if name not in points:
        raise InputError(f"unknown {kind} {name!r}{did_you_mean(name, points)}; known: "
                         f"{', '.join(points) or 'none'}, or a dotted path 'package.module:Class'")
    return imported(kind, f"{points[name].module}:{points[name].attr}")


def parameters(kind: str, name: str) -> type[Params]:
    """The parameter block of the plug-in called ``name``. Raises ``InputError``."""
    block = getattr(load(kind, name), "Params", None)
    if not (isinstance(block, type) and issubclass(block, Params)):
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
