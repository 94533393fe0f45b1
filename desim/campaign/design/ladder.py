"""A comparison on every rung of the fidelity ladder, as a design made in memory, not a file."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence

from desim.campaign.design.design import Design, LoadedDesign
from desim.errors import InputError
from desim.scenario import merge, yaml12
from desim.scenario.complaints import validated
from desim.scenario.source_places import Places, SourcePlace, path_of

RUNGS = ("ideal", "disk", "walls", "mac", "multihop")  # the last one is the highest
FIDELITY = "network.fidelity"
RUNG = "rung"  # the parameter
COMPARED = "coordination.strategy=nearest_frontier,random_frontier"


def ladder_design(scenario: str, compare: str = COMPARED, seeds: int = 5,
                  metric: str | None = None, overrides: Sequence[str] = ()) -> LoadedDesign:
    """A design of all rungs and the values of ``A.B.C=V1,V2,...``, with ``overrides`` (``A.B.C=V``)
    in every run, ranked by ``metric`` (None: by what leads the task). Raises ``InputError``."""
    place = SourcePlace(f"--compare {compare}")
    key, equals, text = compare.partition("=")
    key, words = key.strip(), [word.strip() for word in text.split(",")]
    if not equals or not all(key.split(".")) or not all(words) or len(words) < 2:
        raise InputError(f"{place.source}: must look like a.b.c=value,value, e.g. {COMPARED}")
    if not os.path.isfile(scenario):
        raise InputError(f"no such file: {scenario}")
    values = [yaml12.parse_value(word, place.source) for word in words]
    name = _name(key)
    data = {
        "name": f"ladder_{os.path.basename(scenario).removesuffix('.yaml')}_{name}",
        "question": f"Which of {' and '.join(words)} ({key}) is better, and does the answer depend "
                    "on how true to life the network is?",
        "base": scenario,
        "set": dict(_setting(override) for override in overrides),
        "parameters": {RUNG: {"key": FIDELITY, "values": list(RUNGS)},
                       name: {"key": key, "values": values}},
        "iterations": seeds,
        "report": {"against": RUNG, "by": name} | ({} if metric is None else {
            "metrics": [metric]})}
    places = Places(SourcePlace("desim ladder"))
    for path in (("parameters", name), ("parameters", name, "values")):
        places.put(path, place, place)
    design = validated(Design, data)
    if isinstance(design, list):
        raise InputError(*dict.fromkeys(complaint.line(places) for complaint in design))
    return LoadedDesign(design, places, merge.extended(scenario), "desim ladder")


def _setting(override: str) -> tuple[str, object]:
    source = f"--set {override}"
    key, equals, text = override.partition("=")
    if not equals or not all(key.split(".")):
        raise InputError(f"{source}: must look like a.b.c=value, e.g. fleet.size=8")
    return key.strip(), yaml12.parse_value(text, source)


def _name(key: str) -> str:
    """The name of the parameter: the key's last part that is a word."""
    words = [part for part in path_of(key) if isinstance(part, str)
             and re.fullmatch(r"[A-Za-z]\w*", part)]
    return words[-1][:60] if words and words[-1] != RUNG else "setting"
