"""Designs from a command line, ``--vary A.B.C=V1,V2``: made in memory, kept by their campaigns."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

from desim.campaign.design.columns import FIXED
from desim.campaign.design.design import Design, LoadedDesign
from desim.campaign.design.parameters import label_of
from desim.errors import InputError
from desim.scenario import yaml12
from desim.scenario.complaints import validated
from desim.scenario.load import changes_of, scenario_document
from desim.scenario.source_places import Places, SourcePlace

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,59}")


class Varied(NamedTuple):
    """A key of the scenario with its values, and where they were written."""

    key: str
    values: list[object]
    place: SourcePlace

    @property
    def labels(self) -> list[str]:
        return [label_of(value) for value in self.values]


def varied(option: str, text: str, example: str) -> Varied:
    """The key and the values of ``A.B.C=V1,V2,...``, each YAML. Raises ``InputError``."""
    place = SourcePlace(f"{option} {text}")
    key, _, words = (part.strip() for part in text.partition("="))
    values = yaml12.parse_value(f"[{words}]", place.source)
    if not all(key.split(".")) or not isinstance(values, list) or len(values) < 2:
        raise InputError(f"{place}: must look like a.b.c=value,value, e.g. {example}")
    return Varied(key, values, place)


def varied_design(scenario: str, vary: Sequence[str], seeds: int = 10,
                  overrides: Sequence[str] = ()) -> LoadedDesign:
    """The design of all combinations of the values of ``vary`` (each ``A.B.C=V1,V2,...``), with
    ``overrides`` (``A.B.C=V``) in every run. Raises ``InputError``."""
    wanted = [varied("--vary", text, "fleet.size=4,8") for text in vary]
    keys = [one.key for one in wanted]
    for i, one in enumerate(wanted):
        if one.key in keys[:i]:
            raise InputError(f"{one.place}: {one.key} is varied already")
    names = [name_of(key, keys) for key in keys]
    described = " and ".join(f"{one.key} ({', '.join(one.labels)})" for one in wanted)
    return designed("desim sweep", scenario, dict(zip(names, wanted, strict=True)), overrides, {
        "name": "_".join((stem(scenario), *names))[:100],
        "question": f"How does {stem(scenario)} change with {described}?", "iterations": seeds})


def designed(command: str, scenario: str, parameters: Mapping[str, Varied],
             overrides: Sequence[str], rest: Mapping[str, object]) -> LoadedDesign:
    """A design that no file has; complaints about it begin with the option, or with ``command``.
    Raises ``InputError``."""
    if not os.path.isfile(scenario):
        raise InputError(f"no such file: {scenario}")
    base, changes, places = (scenario_document(scenario), changes_of(overrides),
                             Places(SourcePlace(command)))
    for change in changes:
        places.put_all(change.value, change.place, ("set", change.path))
    for name, one in parameters.items():
        places.put_all({"values": one.values}, one.place, ("parameters", name))
    design = validated(Design, {
        **rest, "base": scenario, "set": {change.path: change.value for change in changes},
        "parameters": {name: {"key": one.key, "values": one.values}
                       for name, one in parameters.items()}})
    if isinstance(design, list):
        raise InputError(*dict.fromkeys(complaint.line(places) for complaint in design))
    return LoadedDesign(design, places, base, command)


def stem(scenario: str) -> str:
    """A scenario's file name without its suffix, as part of a name."""
    name = os.path.splitext(os.path.basename(scenario))[0]
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_-") or "scenario"


def name_of(key: str, keys: Sequence[str], taken: Collection[str] = FIXED) -> str:
    """A parameter's name: the end of its key that no other of ``keys`` has and that is not
    ``taken``, as short as it can be."""
    def ends(one: str) -> list[str]:
        steps = re.sub(r"[^A-Za-z0-9_.]", "_", one).split(".")
        return ["_".join(steps[i:]) for i in reversed(range(len(steps)))]

    others = {*taken, *(end for other in keys if other != key for end in ends(other))}
    return next((end for end in ends(key) if _NAME.fullmatch(end) and end not in others),
                f"setting_{keys.index(key)}")
