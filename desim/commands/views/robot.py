"""The facts of a robot that was read from files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypedDict

from desim.imports.robots.found import FoundRobot
from desim.scenario.file_kinds import FileKind
from desim.scenario.schema.fleet import BodyType, RobotType
from desim.scenario.schema.navigation import Navigation
from desim.scenario.schema.robot import Laser
from desim.scenario.schema.shapes import keys
from desim.scenario.source_places import dotted

_SHOWN = 6  # keys of a section


class RobotFacts(TypedDict):
    """Each key that was read, with its value and place; the keys that stayed at their defaults; by
    section, the keys of the files that have no counterpart, each with its place."""

    name: str
    files: list[tuple[str, str]]
    read: dict[str, tuple[object, str]]
    defaults: list[str]
    no_counterpart: dict[str, list[tuple[str, str]]]
    notes: list[str]


def facts(name: str, files: Sequence[Path], kinds: Sequence[FileKind], found: FoundRobot,
          kind: RobotType) -> RobotFacts:
    """The facts of a robot that was found in files of these kinds."""
    read: dict[str, tuple[object, str]] = {}
    for path, (value, place) in found.values.items():
        parts = value.items() if isinstance(value, dict) else [(None, value)]
        read.update({dotted(path if key is None else (*path, key)): (part, str(place))
                     for key, part in parts})
    groups: dict[str, list[tuple[str, str]]] = {}
    for unused in found.unused:
        groups.setdefault(unused.section, []).append((unused.key, str(unused.place)))
    own = [*(key for key in keys(BodyType)),
           *(f"robot.navigation.{key}" for key in keys(Navigation) if key != "constants"),
           *(() if kind.robot and kind.robot.lasers
             else (f"robot.laser.{key}" for key in keys(Laser)))]
    passed = {"radius", "footprint"} if {"radius", "footprint"} & read.keys() else set()
    return {"name": name,
            "files": [(str(file), one.name) for file, one in zip(files, kinds, strict=True)],
            "read": read, "defaults": [key for key in own if key not in {*read, *passed}],
            "no_counterpart": groups, "notes": list(found.notes)}


def text(known: RobotFacts, to: Path | None) -> str:
    """The facts in lines, and how a scenario takes the file that was written."""
    wide = max(map(len, known["read"]))
    lines = [f"{file}: {kind}" for file, kind in known["files"]]
    lines += ["", f"{known['name']}:", *(f"  {key:<{wide}}  {_short(value)}  ({place})"
                                         for key, (value, place) in known["read"].items())]
    if known["no_counterpart"]:
        lines += ["", "no counterpart:"]
        for section, unused in known["no_counterpart"].items():
            names = ", ".join(key for key, _ in unused[:_SHOWN])
            more = f", and {len(unused) - _SHOWN} more" if len(unused) > _SHOWN else ""
            lines.append(f"  {unused[0][1]}: {section}: {names}{more}")
    by_section: dict[str, list[str]] = {}
    for key in known["defaults"]:
        section, _, last = key.rpartition(".")
        by_section.setdefault(section or "body", []).append(last)
    lines += ["", "at their defaults:",
              *(f"  {section}: {', '.join(names)}" for section, names in by_section.items())]
    lines += [f"note: {note}" for note in known["notes"]]
    if to is not None:
        lines.append(f"written: {to}; a scenario takes it by the line extends: {to.name}")
    return "\n".join(lines)


def _short(value: object) -> str:
    return (", ".join(f"({', '.join(map(str, corner))})" for corner in value)
            if isinstance(value, list) else str(value))
