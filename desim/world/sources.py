"""From the environment family of a scenario to a ``Terrain``: one way for each source."""

from __future__ import annotations

import numpy as np

from desim.errors import InputError
from desim.scenario.environment import MapFile, Shape
from desim.world import mapserver, materials
from desim.world.builtin import BUILTIN
from desim.world.drawing import draw
from desim.world.geometry import TOUCH_M, merge_collinear, rectangle, segments
from desim.world.terrain import Terrain

# What a shape's bounds and blocks are to the radio: faces as thick as a cell of the paper's maps.
FACE_MATERIAL, FACE_THICKNESS_M, FACE_HEIGHT_M = "concrete", 0.2, 2.0

MAX_SIDE_M = 10_000.0  # the tiles of the index of walls, 8 m each, fill memory beyond

WHERE = "environment.terrain"  # errors begin with the path of what is wrong
Kind = tuple[int, float, float]  # material, thickness, height: only walls of one kind are merged


def load(source: str | MapFile | Shape) -> Terrain:
    """The terrain that ``environment.terrain`` names, with maps by their absolute paths.

    Raises ``InputError`` for everything that is wrong with a map or a shape.
    """
    terrain = _read(source)
    x0, y0, x1, y1 = terrain.bounds
    if max(x1 - x0, y1 - y0) > MAX_SIDE_M:
        where = f"{WHERE}.size" if isinstance(source, Shape) else WHERE
        raise InputError(f"{where}: the terrain is {x1 - x0:g} m by {y1 - y0:g} m; allowed: at "
                         f"most {MAX_SIDE_M:g} m a side")
    return terrain


def _read(source: str | MapFile | Shape) -> Terrain:
    if isinstance(source, Shape):
        return from_shape("shape", source)
    if isinstance(source, MapFile):
        try:
            return mapserver.load(source)
        except InputError as error:
            raise InputError(*(f"{WHERE}: {line}" for line in error.args)) from None
    return from_shape(source, BUILTIN[source]())


def from_shape(name: str, shape: Shape) -> Terrain:
    """Bounds, rectangles, walls and drawing of a shape; collinear touching walls of one kind
    become one. Raises ``InputError`` for what has no extent or lies outside."""
    width, depth = shape.size_m
    bounds = (-width / 2, -depth / 2, width / 2, depth / 2)
    face = (materials.NAMES.index(FACE_MATERIAL), FACE_THICKNESS_M, FACE_HEIGHT_M)
    kinds: dict[Kind, list] = {face: rectangle(*bounds)}
    solids = []
    for i, block in enumerate(shape.rectangles):
        what = f"{WHERE}.rectangles.{i}"
        (x0, x1), (y0, y1) = block.x_m, block.y_m
        inside(what, bounds, [(x0, y0), (x1, y1)])
        kind = (materials.index(block.material, what), FACE_THICKNESS_M, block.height_m)
        kinds.setdefault(kind, []).extend(rectangle(x0, y0, x1, y1))
        solids.append((x0, y0, x1, y1))
    for i, wall in enumerate(shape.walls):
        what = f"{WHERE}.walls.{i}"
        inside(what, bounds, [wall.start_m, wall.end_m])
        kind = (materials.index(wall.material, what), wall.thickness_m, wall.height_m)
        kinds.setdefault(kind, []).append(line(what, wall.start_m, wall.end_m))
    if shape.drawing is not None:
        what = f"{WHERE}.drawing"
        drawn = draw(shape.drawing, shape.size_m, what)
        kind = (materials.index(shape.drawing.material, what), FACE_THICKNESS_M,
                shape.drawing.height_m)
        kinds.setdefault(kind, []).extend(drawn.walls.tolist())
        solids.extend(drawn.solids.tolist())
    return _assembled(name, kinds, segments(solids), bounds)


def line(what: str, start: tuple[float, float], end: tuple[float, float],
         ) -> tuple[float, float, float, float]:
    """x1 y1 x2 y2. Raises ``InputError`` when the ends coincide."""
    if abs(start[0] - end[0]) <= TOUCH_M and abs(start[1] - end[1]) <= TOUCH_M:
        raise InputError(f"{what}: it starts and ends at ({start[0]:g}, {start[1]:g}) m")
    return (*start, *end)


def inside(what: str, bounds: tuple, points: list[tuple[float, float]]) -> None:
    """Raises ``InputError`` for one of ``points`` that lies outside ``bounds`` x0 y0 x1 y1."""
    x0, y0, x1, y1 = bounds
    for x, y in points:
        if not (x0 - TOUCH_M <= x <= x1 + TOUCH_M and y0 - TOUCH_M <= y <= y1 + TOUCH_M):
            raise InputError(f"{what}: ({x:g}, {y:g}) m lies outside the terrain; allowed: x from "
                             f"{x0:g} to {x1:g} m, y from {y0:g} to {y1:g} m")


def _assembled(name: str, kinds: dict[Kind, list], solids: np.ndarray, bounds: tuple) -> Terrain:
    walls = [merge_collinear(segments(rows)) for _, rows in sorted(kinds.items())]
    counts = [len(rows) for rows in walls]
    material, thickness, height = (np.repeat(column, counts) for column in zip(*sorted(kinds),
                                                                               strict=True))
    return Terrain(name=name, walls=np.concatenate(walls), material=material.astype(np.int64),
                   thickness_m=thickness.astype(float), height_m=height.astype(float),
                   solids=solids, bounds=bounds)
