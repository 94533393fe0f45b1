"""Loading a scenario: its file, the files that it extends, overrides; all errors at once, placed.

``hello.yaml:7:12: network.media.lan.rate: '5 m' ...``: file, line, column, path, what is wrong.
"""

from __future__ import annotations

import copy
import json
import os
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from desim.errors import InputError
from desim.scenario import (
    check,
    file_kinds,
    merge,
    network_checks,
    plugin_choices,
    validation_cache,
    yaml12,
)
from desim.scenario.complaints import Complaint, lines, validated
from desim.scenario.complete import complete, lay_on_given_media
from desim.scenario.schema.fleet import StartFile
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Data, Folder, Path, Places, SourcePlace, path_of
from desim.scenario.starts import listed

# Without its wrong items a list may be too short, and so be wrong itself.
_MOST_PRUNINGS = 3
_MOST_WRONG = 1000  # with more, nobody asks what else is wrong


@dataclass(frozen=True)
class Loaded:
    """A complete scenario, and where each of its parts was written."""

    scenario: Scenario
    places: Places

    def where(self, path: str) -> str:
        """``file:line:column: path``; for a default, the place of the nearest thing around it."""
        return self.places.where(path)

    def placed(self, error: InputError) -> InputError:
        """An error that was found when the parts were built, with places: a line that begins with
        a path, ``fleet.start: robot_0 stands in a wall``, gets the place of that path, any other
        line the name of the file."""
        return InputError(*(self._placed(str(line)) for line in error.args))

    def refuse_programs(self) -> None:
        """Raise ``InputError`` if hosts run real programs: ``desim loop`` alone starts them."""
        if self.scenario.loop.programs:
            raise InputError(f"{self.where('loop.programs')}: hosts run real programs; allowed: "
                             f"desim loop {shlex.quote(self.places.root.source)}")

    def _placed(self, line: str) -> str:
        path, colon, rest = line.partition(": ")
        if colon and path.split(".")[0] in Scenario.model_fields:
            return f"{self.where(path)}: {rest}"
        return f"{self.places.root.source}: {line}"


class Change(NamedTuple):
    """Another value at a dotted path, and where it was written."""

    path: str
    value: object
    place: SourcePlace


def load(path: str | os.PathLike, overrides: Sequence[str] = (), seed: int | None = None) -> Loaded:
    """The scenario in a YAML file, with ``a.b.c=value`` overrides and another seed laid over it.

    Raises ``InputError`` with one line for each thing that is wrong.
    """
    return Variants(scenario_document(os.fspath(path))).of(changes_of(overrides, seed))


def scenario_document(file: str) -> merge.Document:
    """The mapping in a scenario's file, laid over those that it extends, not checked yet. Raises
    ``InputError`` where it has none, and for a design."""
    document = merge.extended(file)
    if "base" in document[0] and "base" not in Scenario.model_fields:
        raise InputError(f"{document[1].where('base')}: this is a design, of many runs: desim "
                         f"sweep {file}")
    if not document[0].keys() & Scenario.model_fields.keys() and (
            advice := file_kinds.advice(file)):
        raise InputError(f"{file}: no scenario; {advice}")
    return document


class Variants:
    """Scenarios of one document (``merge.extended`` reads one), each with changes of its own laid
    over it. The first changes that a scenario shares with the one before are not laid again."""

    def __init__(self, base: merge.Document) -> None:
        self._base = base
        self._laid: list[tuple[str, merge.Document]] = []  # of the last one, change by change

    def of(self, changes: Sequence[Change]) -> Loaded:
        """The scenario with these changes, in their order. Raises ``InputError`` as ``load`` does,
        and for a change that a later one takes away."""
        texts = [repr(change) for change in changes]  # 1 and true are equal, but not the same
        same = 0
        for before, now in zip(self._laid, texts, strict=False):
            if before[0] != now:
                break
            same += 1
        del self._laid[same:]
        for change, text in zip(changes[same:], texts[same:], strict=True):
            self._laid.append((text, merge.changed(
                self._laid[-1][1] if self._laid else self._base, path_of(change.path), change.value,
                change.place)))
        data, places = self._laid[-1][1] if self._laid else self._base
        lost = [f"{change.place}: {change.path}: what is set after it chooses another plug-in or "
                "shape, which takes this away; set this after that"
                for change in changes if path_of(change.path) not in places]
        if lost:
            raise InputError(*lost)
        return _loaded((merge.copied(data), places))


def from_mapping(data: Mapping[str, object], overrides: Sequence[str] = (),
                 seed: int | None = None) -> Loaded:
    """A scenario from a mapping of the same form as a file's; paths are relative to the current
    directory. Raises ``InputError`` with one line for each thing that is wrong."""
    try:
        copied = json.loads(json.dumps(data, allow_nan=False))
    except (TypeError, ValueError) as error:
        raise InputError(f"scenario: must be made of mappings, lists, text, finite numbers, true, "
                         f"false and null: {error}") from None
    if not isinstance(copied, dict):
        raise InputError("scenario: must be a mapping")
    document = merge.document(copied, Places(SourcePlace("scenario")))
    return Variants(document).of(changes_of(overrides, seed))


def changes_of(overrides: Sequence[str], seed: int | None = None) -> list[Change]:
    """The changes that ``a.b.c=value`` stand for; the value is YAML. Raises ``InputError``."""
    changes = []
    for override in (*overrides, *([] if seed is None else [f"seed={seed}"])):
        source = f"--set {override}"
        key, equals, text = override.partition("=")
        if not equals or not all(key.split(".")):
            raise InputError(f"{source}: must look like a.b.c=value, e.g. fleet.size=8")
        changes.append(Change(key.strip(), yaml12.parse_value(text, source), SourcePlace(source)))
    return changes


def _loaded(document: merge.Document) -> Loaded:
    data, places = merge.without_removed(document)

    def folder(path: Path) -> str:
        place = places.value(path)
        return os.path.dirname(place.source) if place.line else ""

    lay_on_given_media(data)
    plugin_choices.make_absolute(data, folder)
    result = validation_cache.scenario(data)
    found = plugin_choices.complaints(data)
    wrong = result if isinstance(result, list) else []
    scenario = _rest(data, [*wrong, *found]) if found or isinstance(result, list) else result
    if scenario is not None:
        scenario, starts = _with_listed_starts(scenario, folder)
        wrong = wrong + starts
        found += check.complaints(scenario, folder, tuple(
            complaint.path for complaint in [*wrong, *found]))
    found += wrong
    if found or scenario is None:
        raise InputError(*lines(found, places))
    scenario = complete(scenario, folder)
    if unfit := list(network_checks.unfit(scenario)):
        raise InputError(*lines(unfit, places))
    return Loaded(scenario, places)


def _rest(data: Data, wrong: list[Complaint]) -> Scenario | None:
    """The scenario without its wrong parts, for the checks of the rest; None if none remains."""
    for _ in range(_MOST_PRUNINGS if len(wrong) <= _MOST_WRONG else 0):
        data = _without(data, wrong)
        scenario = validated(Scenario, {"name": "unnamed", **data})
        wrong = plugin_choices.complaints(data)
        if isinstance(scenario, Scenario) and not wrong:
            return scenario
        wrong += scenario if isinstance(scenario, list) else []
    return None


def _without(data: Data, complaints: list[Complaint]) -> Data:
    pruned = copy.deepcopy(data)
    # From the back, so that the indices of what is still to be removed stay right.
    for path in sorted({complaint.path for complaint in complaints}, key=_steps, reverse=True):
        _remove(pruned, path)
    return pruned


def _steps(path: Path) -> list[tuple[bool, int, str]]:
    return [(isinstance(step, str), step if isinstance(step, int) else 0, str(step))
            for step in path]


def _remove(node: Any, path: Path) -> None:
    for step in path[:-1]:
        try:
            node = node[step]
        except (KeyError, IndexError, TypeError):
            return
    if path and (path[-1] in node if isinstance(node, dict) else isinstance(node, list)):
        del node[path[-1]]


def _with_listed_starts(scenario: Scenario, folder: Folder) -> tuple[Scenario, list[Complaint]]:
    """The start poses of a CSV file as a list: the names in it are names of robots."""
    start = scenario.fleet.start
    if not isinstance(start, StartFile):
        return scenario, []
    path: Path = ("fleet", "start", "file")
    try:
        poses = listed(start, folder(path))
    except InputError as error:
        return scenario, [Complaint(path, line) for line in error.args]
    fleet = scenario.fleet.model_copy(update={"start": poses})
    return scenario.model_copy(update={"fleet": fleet}), []
