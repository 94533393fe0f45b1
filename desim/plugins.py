"""From a name in a scenario to a class: entry points, or a dotted path that the user writes."""

from __future__ import annotations

import importlib
from functools import cache
from importlib.metadata import EntryPoint, entry_points
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
    return imported(kind, points[name].value)


def parameters(kind: str, name: str) -> type[Params]:
    """The parameter block of the plug-in called ``name``. Raises ``InputError``."""
    block = getattr(load(kind, name), "Params", None)
    if not (isinstance(block, type) and issubclass(block, Params)):
        raise InputError(f"the {kind} {name!r} has no class Params, a desim.ports.Params: it is "
                         "not a plug-in for this place")
    return block


def imported(kind: str, path: str) -> Any:
    """What ``package.module:name`` names. Raises ``InputError`` that says why it does not."""
    module, _, attribute = path.partition(":")
    try:
        return getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise InputError(f"cannot load {kind} {path!r}: {error}") from error


def reference(kind: str, name: str, cls: Any) -> str:
    """``package.module:Class``, with its distribution and version where it has one: what a run's
    identity records of a plug-in."""
    point = available(kind).get(name)
    distribution = point.dist if point is not None else None
    version = f" ({distribution.name} {distribution.version})" if distribution else ""
    return f"{cls.__module__}:{cls.__qualname__}{version}"
