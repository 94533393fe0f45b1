"""Buildings of the traffic editor of Open-RMF (``*.building.yaml``): levels, walls and doors.

Its vertices are pixels of a floor plan, y downwards, unless ``coordinate_system`` is
``cartesian_meters``. Measurements, lines of a known length, give the scale. The generator of
building_map_tools makes walls 0.1 m thick and 2.5 m high.
"""

from __future__ import annotations

import math
from pathlib import Path

import yaml

from desim import outside_yaml
from desim.errors import InputError, did_you_mean
from desim.files import content
from desim.imports.terrains.found import Choices, ImportedPlan, Point

_MOST_BYTES = 20_000_000
_THICKNESS_M, _HEIGHT_M = 0.1, 2.5
_PIXELS, _METRES = "reference_image", "cartesian_meters"
# Of a level: what is read, and what says where robots drive and how the plan was drawn.
_KNOWN = ("vertices", "walls", "doors", "measurements", "lanes", "human_lanes", "floors",
          "fiducials", "constraints", "features", "layers")


def read(path: Path, choices: Choices) -> ImportedPlan:
    """The plan of one level: the one that is chosen, or the only one with walls. Raises
    ``InputError``."""
    try:
        data = outside_yaml.read(content(path, _MOST_BYTES))
    except (ValueError, yaml.YAMLError) as error:
        raise InputError(f"{path}: cannot be read as YAML: {' '.join(str(error).split())}"
                         ) from None
    levels = _mapping(path, data, "levels")
    name = _chosen(path, levels, choices.level)
    level, plan = _Level(path, name, _mapping(path, levels, name)), ImportedPlan()
    system = data.get("coordinate_system", _PIXELS)
    if system not in (_PIXELS, _METRES):
        raise InputError(f"{path}: coordinate_system {system!r} is not supported; allowed: "
                         f"{_PIXELS}, {_METRES}")
    scale, flip = (1.0, 1.0) if system == _METRES else (choices.scale or _scale(
        path, [level, *(_Level(path, other, _mapping(path, levels, other))
                        for other in levels if other != name)]), -1.0)
    points = [(scale * x, flip * scale * y) for x, y in level.vertices()]
    height_m = choices.height_m or _HEIGHT_M
    for start, end, parameters in level.lines("walls", len(points)):
        material = choices.material or ("glass" if _parameter(parameters, "alpha", 1.0) < 1.0
                                        else "plasterboard")
        plan.wall(points[start], points[end], _THICKNESS_M, height_m, material)
    for start, end, _ in level.lines("doors", len(points)):
        plan.door(points[start], points[end])
    others = [other for other in levels if other != name]
    if left_out := [*level.others(), *(f"lifts ({len(lifts)})" for lifts in [data.get("lifts")]
                                       if isinstance(lifts, dict) and lifts)]:
        plan.notes.append(f"left out: {', '.join(left_out)}")
    if others:
        plan.notes.append(f"level {name}; others: {', '.join(others)} (--level)")
    if choices.material is None:
        plan.notes.append("walls count as plasterboard, transparent ones as glass (--material)")
    return plan


class _Level:
    """A level of a building, read with care."""

    def __init__(self, path: Path, name: str, data: dict[str, object]) -> None:
        self._where, self._data = f"{path}: levels.{name}", data

    def vertices(self) -> list[Point]:
        """All of them, in the file's units."""
        points = []
        for number, vertex in enumerate(self._rows("vertices")):
            place = [value for value in (vertex[:2] if isinstance(vertex, list) else [])
                     if isinstance(value, int | float) and math.isfinite(value)]
            if len(place) != 2:
                raise InputError(f"{self._where}.vertices.{number}: must begin with two numbers, x "
                                 f"and y, got {vertex!r}")
            points.append((float(place[0]), float(place[1])))
        return points

    def lines(self, key: str, vertices: int) -> list[tuple[int, int, dict[str, object]]]:
        """Lines between two vertices, with their parameters."""
        found = []
        for number, row in enumerate(self._rows(key)):
            ends = row[:2] if isinstance(row, list) else []
            if len(ends) != 2 or not all(type(end) is int and 0 <= end < vertices for end in ends):
                raise InputError(f"{self._where}.{key}.{number}: must begin with the numbers of "
                                 f"two of its {vertices} vertices, got {row!r}")
            given = row[2] if isinstance(row, list) and len(row) > 2 else {}
            found.append((ends[0], ends[1], given if isinstance(given, dict) else {}))
        return found

    def others(self) -> list[str]:
        """Lists that are not read, with their lengths."""
        return [f"{key} ({len(rows)})" for key, rows in self._data.items()
                if key not in _KNOWN and isinstance(rows, list) and rows]

    def _rows(self, key: str) -> list[object]:
        rows = self._data.get(key) or []
        if not isinstance(rows, list):
            raise InputError(f"{self._where}.{key}: must be a list, got {rows!r}")
        return rows


def _chosen(path: Path, levels: dict[str, object], level: str | None) -> str:
    names = [str(name) for name in levels]
    walled = [str(name) for name, data in levels.items()
              if isinstance(data, dict) and data.get("walls")]
    if level is not None and level not in names:
        raise InputError(f"--level {level}: {path} has no such level{did_you_mean(level, names)}; "
                         f"allowed: {', '.join(names)}")
    if level is None and not walled:
        raise InputError(f"{path}: no level has walls; levels: {', '.join(names) or 'none'}")
    return level or walled[0]


def _scale(path: Path, levels: list[_Level]) -> float:
    """m a pixel, of the first level with measurements: the mean of theirs."""
    for level in levels:
        points = level.vertices()
        scales = [length_m / math.dist(points[start], points[end])
                  for start, end, parameters in level.lines("measurements", len(points))
                  if (length_m := _parameter(parameters, "distance", 0.0)) > 0.0
                  and points[start] != points[end]]
        if scales:
            return sum(scales) / len(scales)
    raise InputError(f"{path}: no measurement gives the length of a pixel; use --scale METRES")


def _parameter(parameters: dict[str, object], name: str, default: float) -> float:
    """A parameter, which is written with the number of its type before it."""
    value = parameters.get(name)
    value = value[1] if isinstance(value, list) and len(value) == 2 else value
    return float(value) if isinstance(value, int | float) else default


def _mapping(path: Path, data: object, key: str) -> dict[str, object]:
    found = data.get(key) if isinstance(data, dict) else None
    if not isinstance(found, dict):
        raise InputError(f"{path}: {key}: must be a mapping, got {found!r}")
    return found
