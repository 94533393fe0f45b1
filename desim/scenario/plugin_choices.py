"""The plug-ins that a scenario names: errors in their parameters, and paths of their files.

It reads the raw mapping, and so works even if other parts are wrong.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

from pydantic import ValidationError

from desim import plugins
from desim.errors import InputError
from desim.files import opened
from desim.ports import BesideScenario, Params, yaml_key
from desim.scenario.complaints import Complaint, complaints_of
from desim.scenario.merge import CHOICES
from desim.scenario.plugin_parameters import parse_parameters
from desim.scenario.schema.communication import MediumChoice, PluginChoice, RuleChoice
from desim.scenario.schema.shapes import keys
from desim.scenario.source_places import Data, Folder, Path

MOST_BYTES = 100_000_000  # of a plug-in's file, or a map's image


class PathValue(NamedTuple):
    """``mapping[key]``, at ``path`` of a scenario, names a file or may name a module."""

    path: Path
    mapping: Data
    key: str
    is_file: bool


def complaints(data: Data) -> list[Complaint]:
    """All that is wrong with the plug-ins of a scenario, with their parameters and their files."""
    found: list[Complaint] = []
    for path, block, choice in _choices(data):
        name = choice.get(block.name_key, _default_name(block))
        if not isinstance(name, str):
            continue  # the schema complains
        own = keys(block)
        theirs = {key: value for key, value in choice.items() if key not in own}
        try:
            parse_parameters(block.kind, name, theirs)
        except InputError as error:
            found.append(Complaint((*path, block.name_key), str(error)))
        except ValidationError as error:
            found += [_of_others(wrong, block.kind, name) for wrong in complaints_of(
                error, plugins.parameters(block.kind, name), theirs, path, own)]
        for key in _files_of(block, choice):
            found += _unreadable((*path, key), choice[key])
    return found


def _of_others(complaint: Complaint, kind: str, name: str) -> Complaint:
    """A complaint about a key that other network models have: left over where the model was changed
    by hand."""
    unknown = "unknown key; "
    if kind != "network" or not complaint.text.startswith(unknown):
        return complaint
    key = complaint.path[-1]
    owners = [one for one in plugins.available(kind) if key in keys(plugins.parameters(kind, one))]
    if not owners:
        return complaint
    return complaint._replace(text=f"unknown key of {plugins.bare(name)} (a key of "
                              f"{', '.join(owners)}); {complaint.text.removeprefix(unknown)}")


def _unreadable(path: Path, file: str) -> list[Complaint]:
    try:
        if os.path.exists(file):  # what is not there is for the plug-in to say
            with opened(file, MOST_BYTES):
                pass
    except OSError as error:
        return [Complaint(path, f"{file}: {error.strerror}")]
    return []


def make_absolute(data: Data, folder: Folder) -> None:
    """Write the modules and files that lie beside the file that names them with their folder:
    ``/home/me/my_module:MyModel``."""
    for path, mapping, key, is_file in path_values(data):
        place = folder((*path, key))
        mapping[key] = (os.path.abspath(os.path.join(place, mapping[key])) if is_file
                        else plugins.beside(mapping[key], place))


def path_values(data: Data) -> Iterator[PathValue]:
    """Everything in a scenario that may be named by a dotted path, and every parameter of a plug-in
    that is the path of a file."""
    for family, key in (("physics", "model"), ("stop", "when")):
        for path, mapping in _matching(data, (family,), ()):
            if isinstance(mapping.get(key), str):
                yield PathValue(path, mapping, key, is_file=False)
    for path, block, choice in _choices(data):
        if isinstance(choice.get(block.name_key), str):
            yield PathValue(path, choice, block.name_key, is_file=False)
        for key in _files_of(block, choice):
            yield PathValue(path, choice, key, is_file=True)


def _files_of(block: type[PluginChoice], choice: Data) -> list[str]:
    name = choice.get(block.name_key, _default_name(block))
    return [key for key in (file_keys(block.kind, name) if isinstance(name, str) else ())
            if isinstance(choice.get(key), str)]


def file_keys(kind: str, name: str) -> tuple[str, ...]:
    """The parameters of a plug-in that are paths of files; none where it is no plug-in, which
    ``complaints`` says."""
    try:
        return _file_keys(plugins.parameters(kind, name))
    except InputError:
        return ()


@cache
def _file_keys(block: type[Params]) -> tuple[str, ...]:
    return tuple(info.alias or field for field, info in block.model_fields.items()
                 if any(isinstance(mark, BesideScenario) for mark in info.metadata))


def chosen(part: object, path: str = "") -> Iterator[tuple[str, PluginChoice]]:
    """The plug-ins that a ``part`` of a scenario at ``path`` names, with their paths."""
    if isinstance(part, PluginChoice):
        yield path, part
    if isinstance(part, Params):
        part = {yaml_key(name): getattr(part, name) for name in type(part).model_fields}
    elif isinstance(part, tuple):
        part = dict(enumerate(part))
    if isinstance(part, dict):
        for key, inner in part.items():
            yield from chosen(inner, f"{path}.{key}" if path else key)


def has_fidelity(medium: MediumChoice) -> bool:
    """Whether its model is one of several rungs: it has a parameter ``fidelity``."""
    return "fidelity" in plugins.parameters("network", medium.model).model_fields


@cache
def _default_name(block: type[PluginChoice]) -> object:
    return block.model_fields[block.name_key].default


def _choices(data: Data) -> Iterator[tuple[Path, type[PluginChoice], Data]]:
    for pattern, block in CHOICES.items():
        for path, choice in _matching(data, pattern, ()):
            yield path, block, choice
            rules = choice.get("rules") if block is MediumChoice else None
            for i, rule in enumerate(rules if isinstance(rules, list) else ()):
                if isinstance(rule, dict) and "rule" in rule:
                    yield (*path, "rules", i), RuleChoice, rule


def _matching(data: object, pattern: tuple[str, ...], path: Path) -> Iterator[tuple[Path, Data]]:
    if not isinstance(data, dict):
        return
    if not pattern:
        yield path, data
        return
    for key in data if pattern[0] == "*" else [pattern[0]]:
        if key in data:
            yield from _matching(data[key], pattern[1:], (*path, key))
