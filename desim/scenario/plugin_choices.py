"""The plug-ins that a scenario chooses: their parameters checked, and spelled out."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from functools import cache
from typing import Any

from pydantic import ValidationError

from desim import plugins
from desim.errors import InputError
from desim.files import opened
from desim.ports import BesideScenario, Params
from desim.scenario import parts
from desim.scenario.complaints import Complaint, validated
from desim.scenario.merge import CHOICES, copied
from desim.scenario.places import Folder, Path
from desim.scenario.schema.communication import Medium, PluginChoice, RuleChoice
from desim.scenario.schema.shapes import keys
from desim.scenario.schema.whole import Scenario

MOST_BYTES = 100_000_000  # of a plug-in's file, or a map's image


def complaints(data: dict[str, Any]) -> list[Complaint]:
    """What is wrong with the plug-ins named in a scenario's mapping, and with their parameters.

    Works on what was written, so that it also finds something in a scenario with other errors.
    """
    found: list[Complaint] = []
    for path, kind, key, block, choice in _written(data):
        name = choice.get(key, block.model_fields[key].default)
        if not isinstance(name, str):
            continue  # the schema complains
        own = keys(block)
        theirs = {key: value for key, value in choice.items() if key not in own}
        try:
            params = plugins.parameters(kind, name)
        except InputError as error:
            found.append(Complaint((*path, key), str(error)))
            continue
        try:
            parts.parameters(params, json.dumps(theirs))
        except ValidationError:
            found += validated(params, theirs, path, tuple(own))
    for path, mapping, key in files(data):
        if os.path.exists(mapping[key]):  # what is not there is for the plug-in to say
            try:
                with opened(mapping[key], MOST_BYTES):
                    pass
            except OSError as error:
                found.append(Complaint((*path, key), f"{mapping[key]}: {error.strerror}"))
    return found


def place(data: dict[str, Any], folder: Folder) -> None:
    """Write out, in a scenario's mapping, where the modules and files stand that lie beside the
    file that names them: ``/home/me/my_module:MyModel``."""
    for path, mapping, key in named(data):
        mapping[key] = plugins.beside(mapping[key], folder((*path, key)))
    for path, mapping, key in files(data):
        mapping[key] = os.path.abspath(os.path.join(folder((*path, key)), mapping[key]))


def named(data: dict[str, Any]) -> Iterator[tuple[Path, dict[str, Any], str]]:
    """Path, mapping and key of everything in a scenario that may be named by a dotted path."""
    places = [(path, choice, key) for path, _, key, _, choice in _written(data)]
    places += [(path, mapping, key) for family, key in (("physics", "model"), ("stop", "when"))
               for path, mapping in _matching(data, (family,), ())]
    return (place for place in places if isinstance(place[1].get(place[2]), str))


def files(data: dict[str, Any]) -> Iterator[tuple[Path, dict[str, Any], str]]:
    """Path, mapping and key of every parameter of a plug-in that is the path of a file."""
    for path, kind, name_key, block, choice in _written(data):
        name = choice.get(name_key, block.model_fields[name_key].default)
        for key in file_keys(kind, name) if isinstance(name, str) else ():
            if isinstance(choice.get(key), str):
                yield path, choice, key


def file_keys(kind: str, name: str) -> tuple[str, ...]:
    """The parameters of a plug-in that are paths of files; none where it is no plug-in, which
    ``complaints`` says."""
    try:
        return _file_keys(plugins.parameters(kind, name))
    except InputError:
        return ()


@cache
def _file_keys(block: type[Params]) -> tuple[str, ...]:
    fields = block.model_fields
    return tuple(info.alias or field for field, info in fields.items()
                 if any(isinstance(mark, BesideScenario) for mark in info.metadata))


def has_fidelity(medium: Medium) -> bool:
    """Whether its model is one of several rungs: it has a parameter ``fidelity``."""
    return "fidelity" in plugins.parameters("network", medium.model).model_fields


def spelled_out(scenario: Scenario) -> Scenario:
    """The scenario with every parameter of its plug-ins. Its parameters must be right."""
    media = {name: _spelled("network", medium.model, medium).model_copy(update={
        "rules": tuple(_spelled("rule", rule.rule, rule) for rule in medium.rules)})
        for name, medium in scenario.network.media.items()}
    return scenario.model_copy(update={
        "network": scenario.network.model_copy(update={"media": media}),
        "middleware": _spelled("middleware", scenario.middleware.model, scenario.middleware),
        "coordination": _spelled("strategy", scenario.coordination.strategy,
                                 scenario.coordination),
    })


def _spelled(kind: str, name: str, choice: PluginChoice) -> PluginChoice:
    return choice.model_copy(update=copied(parts.parameters(
        plugins.parameters(kind, name), json.dumps(choice.parameters()))))


def _written(data: dict[str, Any]) -> Iterator[tuple[Path, str, str, type[PluginChoice], dict]]:
    for pattern, (kind, key, block) in CHOICES.items():
        for path, choice in _matching(data, pattern, ()):
            yield path, kind, key, block, choice
            rules = choice.get("rules") if block is Medium else None
            for i, rule in enumerate(rules if isinstance(rules, list) else ()):
                if isinstance(rule, dict) and "rule" in rule:
                    yield (*path, "rules", i), "rule", "rule", RuleChoice, rule


def _matching(data: Any, pattern: tuple[str, ...], path: Path) -> Iterator[tuple[Path, dict]]:
    if not isinstance(data, dict):
        return
    if not pattern:
        yield path, data
        return
    for key in data if pattern[0] == "*" else [pattern[0]]:
        if key in data:
            yield from _matching(data[key], pattern[1:], (*path, key))
