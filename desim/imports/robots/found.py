"""A robot that was found in files: its keys in a scenario, and what the files say beside."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

from desim.scenario.source_places import Data, Path, SourcePlace

Point = tuple[float, float]
_WHOLE_FLEET: Path = ("robot", "mapping", "resolution")  # robots share their maps
_EITHER: dict[Path, Path] = {("footprint",): ("radius",), ("radius",): ("footprint",)}


class Unused(NamedTuple):
    """A key of a file that desim has no counterpart of, in a section of it."""

    section: str
    key: str
    place: SourcePlace


class FoundRobot:
    """The keys of a type of robot, each with the place that it is from; a later one replaces an
    earlier one."""

    def __init__(self) -> None:
        self.values: dict[Path, tuple[object, SourcePlace]] = {}
        self.unused: list[Unused] = []
        self.notes: list[str] = []
        self.limits: dict[Path, float] = {}  # the lowest of each, in SI units

    def put(self, path: Path, value: object, place: SourcePlace) -> None:
        """Set a key of the type. A body has a footprint or a radius."""
        other = self.values.pop(_EITHER.get(path, ()), None)
        if other is not None:
            self.notes.append(f"{place}: {path[0]} replaces that of {other[1]}")
        self.values[path] = value, place

    def document(self, name: str) -> tuple[Data, dict[Path, SourcePlace]]:
        """The part of a scenario that declares the type and chooses it, and its places."""
        data: Data = {}
        places: dict[Path, SourcePlace] = {}
        for path, (value, place) in self.values.items():
            whole = path if path == _WHOLE_FLEET else ("fleet", "types", name, *path)
            below = data
            for step in whole[:-1]:
                below = below.setdefault(str(step), {})
            below[str(whole[-1])] = value
            places[whole] = place
        data.setdefault("fleet", {}).setdefault("types", {}).setdefault(name, {})
        data["fleet"] = {"robots": name, **data["fleet"]}
        return data, places


def hull(points: Iterable[Point]) -> list[Point]:
    """The corners of the convex hull anticlockwise, without those that a straight side passes
    (Andrew's monotone chain)."""
    ordered = sorted(set(points))
    corners: list[Point] = []
    for row in (ordered, ordered[::-1]):
        start = len(corners)
        for point in row:
            while len(corners) >= start + 2 and _turn(corners[-2], corners[-1], point) <= 1e-9:
                corners.pop()
            corners.append(point)
        corners.pop()
    return corners


def _turn(a: Point, b: Point, c: Point) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def disc_m(corners: Iterable[Point]) -> float | None:
    """The radius of the disc around (0, 0) that the corners are on; None: they are on none."""
    radii = [math.hypot(*corner) for corner in corners]
    return max(radii) if len(radii) > 8 and min(radii) > 0.99 * max(radii) else None
