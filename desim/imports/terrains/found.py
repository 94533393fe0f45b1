"""A terrain that was found in a file, and the choices that the file leaves open."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

from desim.errors import InputError
from desim.ports import materials
from desim.ports.terrain import Wall
from desim.scenario.schema.environment import Door, MapFile, Polygon, Shape
from desim.units import LENGTH, POSITION
from desim.world.sources import MAX_SIDE_M
from desim.world.terrain import Terrain

Point = tuple[float, float]
NEAREST_M = 0.3  # of a start to a wall: more than the radius of a robot to start with


class Choices(NamedTuple):
    """Facts that a file may leave open; None: as the file says, or as is usual for its format.

    ``scale`` is the length of a unit of a drawing in m.
    """

    level: str | None = None
    resolution_m: float | None = None
    scale: float | None = None
    height_m: float | None = None
    material: str | None = None


def material_of(choices: Choices, default: str) -> int:
    """The row in ``materials.NAMES`` of the chosen material, or of the usual one. Raises
    ``InputError``."""
    return materials.index(choices.material or default, "--material")


class Start(NamedTuple):
    """The pose that a robot of a world starts at."""

    x_m: float
    y_m: float
    heading_rad: float


class FoundTerrain(NamedTuple):
    """A terrain, and how a scenario names it: ``source``, None where it is a raster that has to be
    written as a map first. ``doors`` stand open where they are left out. ``notes`` say what was
    taken for granted or left out."""

    terrain: Terrain
    source: MapFile | Shape | None
    doors: tuple[Door, ...] = ()
    notes: tuple[str, ...] = ()
    starts: tuple[Start, ...] = ()


class ImportedPlan:
    """The walls and blocks of a drawing, collected one by one in m, in the file's own frame."""

    MARGIN_M = 1.0  # of free ground around what stands outermost, where nothing else bounds it

    def __init__(self) -> None:
        self.walls: list[Wall] = []
        self.polygons: list[Polygon] = []
        self.doors: list[Door] = []
        self.notes: list[str] = []
        self._corners: list[Point] = []

    def wall(self, start: Point, end: Point, thickness_m: float, height_m: float,
             material: str) -> None:
        """Add a straight wall, unless it has no length. Raises ``ValueError`` for one that is out
        of reach, or one too many."""
        self._check(start, end)
        if math.dist(start, end) > _SHORTEST_M:
            self._corners += [start, end]
            self.walls.append(Wall(**{"from": written(start), "to": written(end)},
                                   thickness=LENGTH.format(thickness_m),
                                   height=LENGTH.format(height_m), material=material))

    def block(self, points: Iterable[Point], height_m: float, material: str) -> None:
        """Add a solid polygon, without corners that repeat the one before. Raises ``ValueError`` as
        ``wall`` does."""
        corners: list[Point] = []
        for point in points:
            if not corners or math.dist(point, corners[-1]) > _SHORTEST_M:
                corners.append(point)
        self._check(*corners)
        if len(corners) > 1 and math.dist(corners[0], corners[-1]) <= _SHORTEST_M:
            corners.pop()
        if len(corners) < 2:
            return
        low, high = (tuple(map(pick, zip(*corners, strict=True))) for pick in (min, max))
        if min(high[0] - low[0], high[1] - low[1]) <= _SHORTEST_M or len(corners) == 2:
            ends = (min(corners), max(corners))
            self.wall(*ends, _SHORTEST_M, height_m, material)
        else:
            self._corners += corners
            self.polygons.append(Polygon(points=tuple(map(written, corners)), material=material,
                                         height=LENGTH.format(height_m)))

    def door(self, start: Point, end: Point) -> None:
        """Add a door that stands open."""
        if math.dist(start, end) > _SHORTEST_M:
            self._corners += [start, end]
            self.doors.append(Door(**{"from": written(start), "to": written(end)},
                                   open=(("0 s", "1000 h"),)))

    @property
    def side_m(self) -> float:
        """The longer side of what was drawn."""
        return max(max(axis) - min(axis) for axis in zip(*self._corners or [(0.0, 0.0)],
                                                         strict=True))

    def _check(self, *points: Point) -> None:
        for x, y in points:
            if not (abs(x) <= _FARTHEST_M and abs(y) <= _FARTHEST_M):
                raise ValueError(f"({x:g}, {y:g}) m is too far away; is the scale right? (--scale)")
        if len(self.walls) + len(self.polygons) >= _MOST_PARTS:
            raise ValueError(f"more than {_MOST_PARTS} walls and blocks; an image of it can be "
                             "read")

    def shape(self, path: object) -> Shape:
        """All of it, with bounds that leave a margin. Raises ``InputError`` for an empty plan."""
        if not self.walls and not self.polygons:
            raise InputError("; ".join([f"{path}: no wall and no block found", *self.notes]))
        xs, ys = zip(*self._corners, strict=True)
        x0, y0, x1, y1 = min(xs), min(ys), max(xs), max(ys)
        if max(x1 - x0, y1 - y0) > MAX_SIDE_M - 2 * self.MARGIN_M:
            raise InputError(f"{path}: {x1 - x0:g} m by {y1 - y0:g} m; allowed: at most "
                             f"{MAX_SIDE_M:g} m a side; is the scale right? (--scale)")
        size = [LENGTH.format(round(high - low + 2 * self.MARGIN_M, 6))
                for low, high in ((x0, x1), (y0, y1))]
        return Shape(size=tuple(size), centre=written(((x0 + x1) / 2, (y0 + y1) / 2)),
                     walls=tuple(self.walls), polygons=tuple(self.polygons))


_MOST_PARTS = 100_000
_FARTHEST_M = 10_000_000.0  # drawings on a country's grid have coordinates of thousands of km
_SHORTEST_M = 0.001  # what is shorter is a point


def written(point: Point) -> tuple[str, str]:
    """A point as a scenario has it, to a micrometre."""
    x_m, y_m = (POSITION.format(round(float(value), 6)) for value in point)
    return x_m, y_m
