"""The sources of terrain: names, maps, shapes and generated ones, each read into a ``Terrain``."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from desim.errors import InputError
from desim.ports import materials
from desim.ports.terrain import Wall
from desim.scenario.schema.environment import Drawing, MapFile, Shape
from desim.scenario.schema.generated import Generated
from desim.world import map_files, paper_terrains, polygons
from desim.world.drawn_terrain import draw
from desim.world.generated import generator
from desim.world.geometry import TOUCH_M, Row, merge_collinear, rectangle, segments
from desim.world.obstacles import BLOCK_M, FACE_M, Matter, crossing, of_cells
from desim.world.terrain import Terrain

FACE_MATERIAL, FACE_HEIGHT_M = "concrete", 2.0  # of a shape's bounds

MAX_SIDE_M = 10_000.0  # the tiles of the index of walls, 8 m each, fill memory beyond

WHERE = "environment.terrain"  # errors begin with the path of the wrong value


class Kind(NamedTuple):
    """The properties of a wall. Only walls of one kind are merged."""

    material: int
    thickness_m: float
    height_m: float
    block: bool = False  # the face of a block


def load(source: str | MapFile | Shape | Generated) -> Terrain:
    """The terrain that ``environment.terrain`` names, with maps by their absolute paths.

    Raises ``InputError`` for a map, a shape or a plan that is wrong.
    """
    if isinstance(source, Shape):
        terrain = from_shape("shape", source)
    elif isinstance(source, MapFile):
        other = materials.index(source.material, f"{WHERE}.material")
        try:
            terrain = map_files.load(source, other)
        except InputError as error:
            raise InputError(*(f"{WHERE}: {line}" for line in error.args)) from None
    elif isinstance(source, str):
        terrain = from_shape(source, paper_terrains.shape(source))
    else:
        terrain = from_shape(*generator.shape_of(source))
    x0, y0, x1, y1 = terrain.bounds
    if max(x1 - x0, y1 - y0) > MAX_SIDE_M:
        where = (f"{WHERE}.size" if isinstance(source, Shape) else
                 WHERE if isinstance(source, str | MapFile) else f"{WHERE}.{terrain.name}.size")
        raise InputError(f"{where}: the terrain is {x1 - x0:g} m by {y1 - y0:g} m; allowed: at "
                         f"most {MAX_SIDE_M:g} m a side")
    return terrain


def from_shape(name: str, shape: Shape) -> Terrain:
    """Bounds, rectangles, polygons, walls and drawing of a shape; collinear touching walls of one
    kind become one. Raises ``InputError`` for a part without extent or outside."""
    (width, depth), (x_m, y_m) = shape.size_m, shape.centre_m
    bounds = (x_m - width / 2, y_m - depth / 2, x_m + width / 2, y_m + depth / 2)
    face = Kind(materials.NAMES.index(FACE_MATERIAL), FACE_M, FACE_HEIGHT_M)
    parts = Parts()
    parts.add(face, rectangle(*bounds), face, rectangle(*bounds))
    for i, block in enumerate(shape.rectangles):
        what = f"{WHERE}.rectangles.{i}"
        (x0, x1), (y0, y1) = block.x_m, block.y_m
        inside(what, bounds, [(x0, y0), (x1, y1)])
        kind = Kind(materials.index(block.material, f"{what}.material"), FACE_M, block.height_m)
        parts.add(kind, rectangle(x0, y0, x1, y1), *_of_block(kind, x0, y0, x1, y1))
        parts.fill([(x0, y0, x1, y1)], block.height_m)
    for i, polygon in enumerate(shape.polygons):
        what = f"{WHERE}.polygons.{i}"
        inside(what, bounds, list(polygon.points_m))
        kind = Kind(materials.index(polygon.material, f"{what}.material"), FACE_M,
                    polygon.height_m)
        points = _corners(what, polygon.points_m)
        parts.add(kind, polygons.sides(points), *_of_polygon(kind, points))
        parts.fill(polygons.strips(points), polygon.height_m)
    for kind, rows in by_kind(shape.walls, f"{WHERE}.walls", bounds).items():
        parts.add(kind, rows, kind, rows)
    cells = None if shape.drawing is None else _add_drawing(parts, shape, shape.drawing, bounds)
    of_what, lines = _merged(parts.walls)
    tops_m = np.where(_on_bounds(lines, bounds), np.inf, [kind.height_m for kind in of_what])
    return Terrain(name=name, walls=lines, matter=partial(matter_of, parts.matter, cells),
                   tops_m=tops_m, solids=segments(parts.solids),
                   solid_tops_m=np.array(parts.solid_tops_m), bounds=bounds)


class Parts:
    """The parts of a shape so far: ``walls`` that bodies meet and ``matter`` that the radio meets,
    both by kind, and what is solid, rectangles with their heights."""

    def __init__(self) -> None:
        self.walls: dict[Kind, list[Row]] = {}
        self.matter: dict[Kind, list[Row]] = {}
        self.solids: list[Row] = []
        self.solid_tops_m: list[float] = []

    def add(self, kind: Kind, walls: list[Row], of_matter: Kind, matter: list[Row]) -> None:
        self.walls.setdefault(kind, []).extend(walls)
        self.matter.setdefault(of_matter, []).extend(matter)

    def fill(self, solids: list[Row], height_m: float) -> None:
        self.solids += solids
        self.solid_tops_m += [height_m] * len(solids)


def _add_drawing(parts: Parts, shape: Shape, drawing: Drawing, bounds: Row) -> Matter | None:
    """Add the walls of a drawing, and return the matter of its blocks."""
    what = f"{WHERE}.drawing"
    drawn, blocks, blocked = draw(drawing, shape.size_m, shape.centre_m, what)
    kind = Kind(materials.index(drawing.material, f"{what}.material"), FACE_M, drawing.height_m)
    parts.add(kind, drawn.tolist(), kind, drawn.tolist() if blocked is None else [])
    parts.fill(blocks.tolist(), drawing.height_m)
    if blocked is None:
        return None
    return of_cells(blocked, kind.material, drawing.cell_m, bounds[:2], kind.height_m)


def _on_bounds(lines: np.ndarray, bounds: Row) -> np.ndarray:
    """[n] bool: which of ``lines`` [n, 4] lie on a side of ``bounds``."""
    sides = np.array([(bounds[axis], bounds[axis + 2]) for axis in (0, 1)])
    ends = lines.reshape(-1, 2, 2, 1)  # [line, end, axis, side]
    return (np.abs(ends - sides) <= TOUCH_M).all(axis=1).any(axis=(1, 2))


def _of_block(kind: Kind, x0: float, y0: float, x1: float, y1: float) -> tuple[Kind, list[Row]]:
    """The matter of a rectangle: its faces, or if it is thin a wall along its middle."""
    thin_m = min(abs(x1 - x0), abs(y1 - y0))
    if thin_m > BLOCK_M:
        return kind._replace(block=True), rectangle(x0, y0, x1, y1)
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    along = (x, y0, x, y1) if abs(x1 - x0) == thin_m else (x0, y, x1, y)
    return kind._replace(thickness_m=thin_m), [along]


def by_kind(walls: Sequence[Wall], where: str, bounds: Row) -> dict[Kind, list[Row]]:
    """Drawn walls that stand at the path ``where``. Raises ``InputError`` as ``line`` does, and for
    unknown materials."""
    kinds: dict[Kind, list[Row]] = {}
    for i, wall in enumerate(walls):
        what = f"{where}.{i}"
        kind = Kind(materials.index(wall.material, f"{what}.material"), wall.thickness_m,
                    wall.height_m)
        kinds.setdefault(kind, []).append(line(what, bounds, wall.start_m, wall.end_m))
    return kinds


def _of_polygon(kind: Kind, points: np.ndarray) -> tuple[Kind, list[Row]]:
    """The matter of a polygon: its sides, or if it is thin a wall along its middle."""
    if (wall := polygons.middle(points)) is None:
        return kind._replace(block=True), polygons.sides(points)
    along, thickness_m = wall
    return kind._replace(thickness_m=thickness_m), [along]


def _corners(what: str, points_m: tuple[tuple[float, float], ...]) -> np.ndarray:
    """[n, 2] m. Raises ``InputError`` for two corners in a row at one place, and for a polygon
    without extent."""
    points = np.array(points_m)
    apart = np.hypot(*(np.roll(points, -1, axis=0) - points).T)
    if (again := np.flatnonzero(apart <= TOUCH_M)).size:
        x, y = points[again[0]]
        raise InputError(f"{what}.points: two corners in a row lie at ({x:g}, {y:g}) m")
    if min(np.ptp(points, axis=0)) <= TOUCH_M:
        raise InputError(f"{what}.points: all corners lie on one line")
    return points


def line(what: str, bounds: Row, start: tuple[float, float], end: tuple[float, float]) -> Row:
    """A wall from ``start`` to ``end``. Raises ``InputError`` when the ends coincide, or when one
    lies outside ``bounds``."""
    inside(what, bounds, [start, end])
    if abs(start[0] - end[0]) <= TOUCH_M and abs(start[1] - end[1]) <= TOUCH_M:
        raise InputError(f"{what}: it starts and ends at ({start[0]:g}, {start[1]:g}) m")
    return (*start, *end)


def inside(what: str, bounds: Row, points: list[tuple[float, float]]) -> None:
    """Raise ``InputError`` if one of ``points`` lies outside ``bounds`` x0 y0 x1 y1."""
    x0, y0, x1, y1 = bounds
    for x, y in points:
        if not (x0 - TOUCH_M <= x <= x1 + TOUCH_M and y0 - TOUCH_M <= y <= y1 + TOUCH_M):
            raise InputError(f"{what}: ({x:g}, {y:g}) m lies outside the terrain; allowed: x from "
                             f"{x0:g} to {x1:g} m, y from {y0:g} to {y1:g} m")


def _merged(kinds: dict[Kind, list[Row]]) -> tuple[list[Kind], np.ndarray]:
    """[n] kinds and [n, 4] walls; collinear walls of one kind that touch are one."""
    walls = [(kind, merge_collinear(segments(rows))) for kind, rows in sorted(kinds.items())]
    return ([kind for kind, rows in walls for _ in rows],
            np.concatenate([rows for _, rows in walls]))


def matter_of(kinds: dict[Kind, list[Row]], cells: Matter | None) -> Matter:
    """The matter of a shape: its blocks that are drawn in cells, then all the rest."""
    of_what, walls = _merged(kinds)
    material, thickness_m, height_m, block = (np.array(column)
                                              for column in zip(*of_what, strict=True))
    rest = Matter(walls, material, thickness_m, height_m, block, crossing)
    if cells is None:
        return rest
    segments, material, thickness_m, height_m, block = (
        np.concatenate(pair) for pair in zip(cells[:5], rest[:5], strict=True))
    return Matter(segments, material, thickness_m, height_m, block, cells.crossing)
