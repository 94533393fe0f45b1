"""The reader of each format of robots, and the type that several files make together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from desim.errors import InputError
from desim.files import reading, target
from desim.imports.robots import parameters, urdf
from desim.imports.robots.found import FoundRobot
from desim.imports.robots.parameters import RosParameter
from desim.scenario import file_kinds, merge, yaml12
from desim.scenario.file_kinds import FileKind, kind_of
from desim.scenario.load import Variants
from desim.scenario.schema.fleet import RobotType
from desim.scenario.source_places import Places, SourcePlace

_PARAMETERS: dict[FileKind, Callable[[Path, FoundRobot], list[RosParameter]]] = {
    file_kinds.ROS_PARAMETERS: parameters.of_yaml,
    file_kinds.LAUNCH: parameters.of_launch,
}


def read_robot(files: Sequence[Path]) -> tuple[list[FileKind], FoundRobot]:
    """The robot that files of any formats that desim knows describe, the later ones before the
    earlier ones, and their formats. Raises ``InputError``."""
    kinds, found = [], FoundRobot()
    given: list[list[RosParameter]] = []  # none of a description
    for path in files:
        with reading(path):
            kinds.append(kind := _robot_kind(path))
            given.append(_PARAMETERS[kind](path, found) if kind in _PARAMETERS else [])
    inert = parameters.inert_sections([one for of_file in given for one in of_file], found)
    for path, kind, of_file in zip(files, kinds, given, strict=True):
        if kind in _PARAMETERS:
            parameters.take(of_file, inert, found)
        else:
            with reading(path):
                urdf.read(path, found)
    if not found.values:
        keys = ", ".join(dict.fromkeys(unused.key for unused in found.unused)) or "none"
        raise InputError("; ".join([f"{files[0]}: has no key with a counterpart in a type of robot "
                                    f"(docs/robots.md), has {keys[:200]}", *found.notes]))
    return kinds, found


def _robot_kind(path: Path) -> FileKind:
    kind = kind_of(path)
    if kind is None and path.suffix in (".yaml", ".yml"):
        kind = file_kinds.ROS_PARAMETERS
    allowed = [file_kinds.URDF, *_PARAMETERS]
    if kind is None or kind not in allowed:
        elsewhere = "" if kind is None else f"; {file_kinds.advice(path)}"
        raise InputError(f"{path}: no robot{elsewhere}; allowed: "
                         f"{', '.join(known.name for known in allowed)}")
    return kind


def type_of(name: str, found: FoundRobot) -> RobotType:
    """The type in a scenario of its own. Raises ``InputError`` with the places in the files."""
    data, at = found.document(name)
    places = Places(SourcePlace(name))
    for path, place in at.items():
        places.put_all(None, place, path)
    try:
        complete = Variants(merge.document({"name": "robot", **data}, places)).of([])
    except InputError as error:
        raise InputError(*error.args, *found.notes) from None
    return complete.scenario.fleet.types[name]


def write(name: str, found: FoundRobot, origins: Sequence[str], path: Path) -> None:
    """Write a file that a scenario can extend. Raises ``InputError``."""
    text = yaml12.dump(found.document(name)[0])
    with target(path, "--to") as beside:
        beside.write_text(f"# Of {', '.join(origins)}, by desim robot; a scenario takes it by "
                          f"extends: {path.name}\n{text}", "utf-8")
