"""Who is in the fleet: names, bodies and starts."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import NamedTuple

from desim.errors import InputError, did_you_mean
from desim.scenario.fleet import BodyType, Fleet, Group, StartFile, StartLine
from desim.scenario.schema import Scenario

BODY_TYPES = {"pioneer3dx": BodyType(), "holonomic": BodyType(drive="holonomic")}


class RobotSpec(NamedTuple):
    """One robot: its body and where it shall start. ``snap`` lets a start inside a wall move."""

    name: str
    body: BodyType
    x_m: float
    y_m: float
    yaw_rad: float
    snap: bool = False


def natural_key(name: str) -> list[tuple[int, int, str]]:
    """Sorts ``robot_2`` before ``robot_10``."""
    return [(0, int(part), "") if part.isdigit() else (1, 0, part)
            for part in re.split(r"(\d+)", name) if part]


def place_fleet(scenario: Scenario, base: Path = Path()) -> list[RobotSpec]:
    """The robots ``robot_1``, ``robot_2``, ... in natural order of their names; the i-th start
    belongs to the i-th robot. Paths start from ``base``.

    Raises ``InputError`` when types, counts and starts do not fit together.
    """
    fleet = scenario.fleet
    listed = _listed_poses(fleet, base)
    bodies = _bodies(fleet, default=1 if listed is None else len(listed))
    if listed is None:
        listed = _line(fleet.start, len(bodies))
    if len(listed) < len(bodies):
        raise InputError(f"fleet.start: {len(listed)} poses for {len(bodies)} robots")
    return [RobotSpec(f"robot_{i + 1}", body, *pose, fleet.start.snap)
            for i, (body, pose) in enumerate(zip(bodies, listed, strict=False))]


def _bodies(fleet: Fleet, default: int) -> list[BodyType]:
    types = {**BODY_TYPES, **fleet.types}
    groups = fleet.robots
    if isinstance(groups, str):
        groups = [Group(type=groups, count=fleet.size or default)]
    bodies: list[BodyType] = []
    for group in groups:
        if group.type not in types:
            raise InputError(f"fleet.robots: unknown type {group.type!r}"
                             f"{did_you_mean(group.type, types)}; known: {', '.join(types)}")
        bodies += [types[group.type]] * group.count
    if not bodies:
        raise InputError("fleet.robots: no robots; at least one group is needed")
    if fleet.size is not None and fleet.size != len(bodies):
        raise InputError(f"fleet.size is {fleet.size}, but the groups have {len(bodies)} robots")
    return bodies


def _line(start: StartLine, count: int) -> list[tuple[float, float, float]]:
    (x, y), (dx, dy) = start.origin_m, start.step_m
    return [(x + i * dx, y + i * dy, start.heading_rad) for i in range(count)]


def _listed_poses(fleet: Fleet, base: Path) -> list[tuple[float, float, float]] | None:
    if isinstance(fleet.start, StartLine):
        return None
    if isinstance(fleet.start, StartFile):
        return _file_poses(base / fleet.start.file)
    return [(pose.x_m, pose.y_m, pose.heading_rad) for pose in fleet.start.poses]


def _file_poses(path: Path) -> list[tuple[float, float, float]]:
    try:
        with path.open(newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file, skipinitialspace=True)
            columns = reader.fieldnames or []
            rows = [(reader.line_num, row) for row in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: cannot be read as CSV: {error}") from None
    missing = [column for column in ("x_m", "y_m") if column not in columns]
    if missing:
        raise InputError(f"{path}: no column {' and '.join(missing)}; the columns are x_m, y_m and "
                         "yaw_rad")
    return [_pose(path, line, row) for line, row in rows]


def _pose(path: Path, line: int, row: dict[str, str]) -> tuple[float, float, float]:
    try:
        pose = float(row["x_m"]), float(row["y_m"]), float(row.get("yaw_rad") or 0.0)
    except (TypeError, ValueError):
        pose = (float("nan"),) * 3
    if not all(abs(number) < float("inf") for number in pose):
        raise InputError(f"{path}:{line}: x_m, y_m and yaw_rad must be finite numbers")
    return pose
