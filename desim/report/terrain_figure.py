"""A picture of a terrain: walls, what is solid, and doors."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from desim.imports.terrains.found import FoundTerrain
from desim.report.picture_file import save
from desim.scenario.schema.environment import Shape
from desim.world.terrain import Raster

_MOST_SQUARES = 2000  # along a side of the picture
_SOLID, _WALL = "#c9ced6", "#1f2933"


@rc_context({"text.parse_math": False, "font.size": 9, "axes.titlesize": 11})
def draw_terrain(found: FoundTerrain, title: str, path: Path) -> None:
    """Write the picture; the file's ending says the format (png, pdf, svg)."""
    terrain = found.terrain
    x0, y0, x1, y1 = terrain.bounds
    figure = Figure(figsize=(8.0, 1.0 + 8.0 * min(max((y1 - y0) / (x1 - x0), 0.3), 3.0)), dpi=160,
                    layout="constrained")
    axes = figure.subplots()
    if terrain.raster is not None:
        shades, edge_m = _shades(terrain.raster)
        rows, cols = shades.shape
        axes.imshow(shades, ListedColormap(["white", _SOLID, _WALL]), vmin=0, vmax=2,
                    origin="lower", extent=(x0, x0 + cols * edge_m, y0, y0 + rows * edge_m))
    else:
        blocks = ([np.array(block.points_m) for block in found.source.polygons]
                  if isinstance(found.source, Shape) else [])
        axes.add_collection(PolyCollection(blocks, facecolor=_SOLID, edgecolor=_SOLID,
                                           linewidth=0.2))
        axes.add_collection(LineCollection(list(terrain.walls.reshape(-1, 2, 2)), color=_WALL,
                                           linewidth=1.0))
    doors = [np.array((door.start_m, door.end_m)) for door in found.doors]
    axes.add_collection(LineCollection(doors, color="#d9822b", linewidth=2.0))
    axes.set(xlim=(x0, x1), ylim=(y0, y1), xlabel="x in m", ylabel="y in m", aspect="equal",
             title=title)
    save(figure, path)


def _shades(raster: Raster) -> tuple[np.ndarray, float]:
    """[rows, cols] uint8: 0 free, 1 solid all around, 2 where a wall is seen from free ground; and
    the side in m of such a square of cells."""
    solid = raster.solid
    beside = np.pad(~solid, 1)
    rim = beside[2:, 1:-1] | beside[:-2, 1:-1] | beside[1:-1, 2:] | beside[1:-1, :-2]
    shades = np.where(solid, 1 + rim.astype(np.uint8), 0)
    side = math.ceil(max(solid.shape) / _MOST_SQUARES)
    for axis, cells in enumerate(solid.shape):
        shades = np.maximum.reduceat(shades, range(0, cells, side), axis)
    return shades, side * raster.resolution_m
