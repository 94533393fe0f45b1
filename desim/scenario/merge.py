"""``extends`` and ``--set``: one mapping laid over another, keeping the place of every part.

Mappings merge, everything else is replaced. Where the upper mapping makes another choice (another
plug-in, another shape of terrain, a fidelity where all media are wires), what belongs to the lower
one's choice is not inherited.
"""

from __future__ import annotations

import os
from collections.abc import Callable

from desim import plugins
from desim.errors import InputError
from desim.scenario import yaml12
from desim.scenario.schema.communication import (
    Coordination,
    Exchange,
    MediumChoice,
    MiddlewareChoice,
    PluginChoice,
    StrategyChoice,
)
from desim.scenario.schema.cost_model import ComputersChoice
from desim.scenario.schema.environment import Environment
from desim.scenario.schema.experiment import TaskChoice
from desim.scenario.schema.fleet import FleetParams
from desim.scenario.schema.navigation import LocalPlannerChoice
from desim.scenario.schema.robot import LocalizationChoice
from desim.scenario.schema.shapes import alternatives, keys, which
from desim.scenario.source_places import Data, Path, Places, SourcePlace, dotted, items

Document = tuple[Data, Places]

# Where a scenario chooses plug-ins; the rules of a medium stand inside of its choice.
CHOICES: dict[tuple[str, ...], type[PluginChoice]] = {
    ("network", "media", "*"): MediumChoice,
    ("middleware",): MiddlewareChoice,
    ("computers",): ComputersChoice,
    ("coordination",): Coordination,
    ("coordination", "exchange"): Exchange,
    ("hosts", "*", "strategy"): StrategyChoice,
    ("fleet", "types", "*", "strategy"): StrategyChoice,
    ("task",): TaskChoice,
    ("robot", "localization"): LocalizationChoice,
    ("fleet", "types", "*", "robot", "localization"): LocalizationChoice,
    ("robot", "navigation", "local"): LocalPlannerChoice,
    ("fleet", "types", "*", "robot", "navigation", "local"): LocalPlannerChoice,
}
_SHAPES = {
    ("environment", "terrain"): Environment.model_fields["terrain"],
    ("fleet", "start"): FleetParams.model_fields["start"],
}
# Mappings of names: null takes an inherited entry away.
_BY_NAME = (("network", "media"), ("hosts",), ("fleet", "types"), ("robot", "lasers"),
            ("fleet", "types", "*", "robot", "lasers"))


def extended(path: str, below: tuple[str, ...] = ()) -> Document:
    """The mapping in a file, laid over those that it extends. Raises ``InputError``."""
    data, places = document(*yaml12.read(path))
    if "extends" not in data:
        return data, places
    parent = data.pop("extends")
    where = places.where("extends")
    if not isinstance(parent, str) or "\0" in parent:
        raise InputError(f"{where}: must be the path of a file, got {parent!r}")
    parent = os.path.normpath(os.path.join(os.path.dirname(path), parent))
    chain = (*below, path)
    loop = [os.path.realpath(file) for file in chain]
    if os.path.realpath(parent) in loop:
        start = loop.index(os.path.realpath(parent))
        raise InputError(f"{where}: a circle: {' -> '.join((*chain[start:], parent))}")
    if not os.path.isfile(parent):
        raise InputError(f"{where}: no such file: {parent}")
    lower, lower_places = extended(parent, chain)
    merged = _mapping(_overlay(lower, data, ()))
    return merged, lower_places.under(places, merged)


def changed(document: Document, path: Path, value: object, place: SourcePlace) -> Document:
    """A document with ``value``, which was written at ``place``, laid over what is at ``path``. The
    given one stays as it is. A plug-in's block may stand where its name belongs:
    ``coordination.strategy={strategy: market, price_m_per_m2: 0}``. Raises ``InputError``."""
    data, places = document
    choice = choice_at(path[:-1])
    if choice is not None and path[-1] == choice.name_key and (
            isinstance(value, dict) and choice.name_key in value):
        path = path[:-1]
    value = _spelled_out(value, path)
    merged = _put(data, path, value, (), str(place))
    top = Places(places.root)  # what nobody wrote is still a default of the file
    below: object = data
    for depth, step in enumerate(path[:-1], 1):  # mappings that had to be made on the way
        below = dict(items(below)).get(step)
        if path[:depth] not in places or not isinstance(below, (dict, list)):
            top.put(path[:depth], place, place)
    top.put_all(value, place, path)
    return _mapping(merged), places.under(top, merged)


def document(data: Data, places: Places) -> Document:
    """A document of what somebody wrote: where the name of a plug-in stands alone, it becomes a
    mapping, ``{model: patrolling}`` for ``task: patrolling``."""
    return _mapping(_spelled_out(data, (), places)), places


def _spelled_out(value: object, path: Path, places: Places | None = None) -> object:
    choice = choice_at(path)
    if choice is not None and isinstance(value, str):
        if places is not None:
            place = places.value(path)
            places.put((*path, choice.name_key), place, place)
        return {choice.name_key: value}
    if isinstance(value, dict):
        return {key: _spelled_out(one, (*path, key), places) for key, one in value.items()}
    return value


def without_removed(document: Document) -> Document:
    """The document without the named things that null took away."""
    data, places = document
    for path in _BY_NAME:
        data = _mapping(_map_at(data, path, lambda entries: {
            name: entry for name, entry in entries.items() if entry is not None}))
    return data, places


def copied(data: Data) -> Data:
    """A copy of a document's mapping, down to its single values."""
    return {key: _copied(value) for key, value in data.items()}


def _copied(data: object) -> object:
    if isinstance(data, dict):
        return copied(data)
    return [_copied(item) for item in data] if isinstance(data, (list, tuple)) else data


def _mapping(data: object) -> Data:
    """``data`` itself: changing what is inside of a mapping leaves it one."""
    assert isinstance(data, dict)
    return data


def choice_at(path: Path) -> type[PluginChoice] | None:
    """The block of the plug-in that is chosen at ``path``."""
    return next((choice for pattern, choice in CHOICES.items() if len(pattern) == len(path) and all(
        wanted in ("*", step) for wanted, step in zip(pattern, path, strict=True))), None)


def _overlay(lower: object, upper: object, path: Path) -> object:
    if not (isinstance(lower, dict) and isinstance(upper, dict)):
        return upper
    merged = _inherited(lower, upper, path)
    for key, value in upper.items():
        merged[key] = _overlay(merged.get(key), value, (*path, key))
    return merged


def _inherited(lower: Data, upper: Data, path: Path) -> Data:
    """The part of ``lower`` that still makes sense under ``upper``."""
    choice = choice_at(path)
    if choice is not None:
        key = choice.name_key
        if key in upper and upper[key] != lower.get(key):
            return {k: v for k, v in lower.items() if k in keys(choice)}
    if path == ("network",) and upper.get("fidelity") and not _rungs(lower):
        return {k: v for k, v in lower.items() if k != "media"}
    if path in _SHAPES:
        shapes = alternatives(_SHAPES[path].annotation)
        before, now = (which(tuple(shapes.values()), data) for data in (lower, upper))
        own = shapes[before] if before else None
        if before != now and isinstance(own, type) and not upper.keys() <= {*keys(own)}:
            return {}
    return dict(lower)


def _rungs(network: Data) -> bool:
    """Whether there is a medium with a fidelity to choose, as far as installed models go."""
    media = network.get("media")
    models = [medium.get("model") if isinstance(medium, dict) else None
              for medium in (media.values() if isinstance(media, dict) else [media])]
    return not all(isinstance(model, str) and model in plugins.available("network")
                   and "fidelity" not in plugins.parameters("network", model).model_fields
                   for model in models)


def _put(node: object, steps: Path, value: object, path: Path, source: str) -> object:
    if not steps:
        return _overlay(node, value, path)
    step, rest = steps[0], steps[1:]
    if isinstance(node, list):
        if not isinstance(step, int) or step >= len(node):
            raise InputError(f"{source}: {dotted(path)}: is a list of {len(node)}; allowed: an "
                             f"index from 0 to {len(node) - 1}, not {step!r}")
        item = _put(node[step], rest, value, (*path, step), source)
        return [*node[:step], item, *node[step + 1:]]
    below = node.get(str(step)) if isinstance(node, dict) else None
    return _overlay(node, {str(step): _put(below, rest, value, (*path, str(step)), source)}, path)


def _map_at(data: object, path: Path, change: Callable[[Data], Data]) -> object:
    if not isinstance(data, dict):
        return data
    if not path:
        return change(data)
    step, rest = path[0], path[1:]
    below = [*data] if step == "*" else [step] if step in data else []
    return {**data, **{name: _map_at(data[name], rest, change) for name in below}}
