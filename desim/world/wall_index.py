"""An index of walls: a grid of tiles, each with a list of the walls within its reach."""

from typing import NamedTuple

import numpy as np

from desim.world.geometry import point_distance


class TileIndex(NamedTuple):
    """``start`` [rows, cols + 1]: the walls of tile (row, col) are
    ``items[start[row, col]:start[row, col + 1]]``, ascending | ``frame`` x0 m, y0 m and
    tiles per m."""

    start: np.ndarray
    items: np.ndarray
    frame: np.ndarray


def tile_index(walls: np.ndarray, bounds: tuple[float, float, float, float], tile_m: float,
               reach_m: float) -> TileIndex:
    """For each tile of ``tile_m`` over ``bounds``, all of ``walls`` [n, 4] that come within
    ``reach_m`` of any point of it (and a few more)."""
    x0, y0, x1, y1 = bounds
    cols = max(int(np.ceil((x1 - x0) / tile_m)), 1)
    rows = max(int(np.ceil((y1 - y0) / tile_m)), 1)
    reach_m += tile_m * np.sqrt(0.5)
    centre_x = x0 + (np.arange(cols) + 0.5) * tile_m
    start = np.zeros((rows, cols + 1), dtype=np.int64)
    items, total = [], 0
    for row in range(rows):
        centres = np.stack([centre_x, np.full(cols, y0 + (row + 0.5) * tile_m)], axis=1)
        tile, wall = np.nonzero(point_distance(centres, walls) <= reach_m)
        start[row, :] = total + np.searchsorted(tile, np.arange(cols + 1))
        total += len(wall)
        items.append(wall)
    return TileIndex(start, np.concatenate(items).astype(np.int64),
                     np.array([x0, y0, 1.0 / tile_m]))
