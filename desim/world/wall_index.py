"""An index of walls: a grid of tiles, each with a list of the walls within its reach."""

import math
from itertools import product
from typing import NamedTuple

import numpy as np

from desim.world.geometry import point_distance

_BESIDE = 16  # tiles that are indexed at a time: few walls are near all of them


class TileIndex(NamedTuple):
    """``start`` [rows, cols + 1]: the walls of tile (row, col) are
    ``items[start[row, col]:start[row, col + 1]]``, ascending | ``frame`` x0 m, y0 m and
    tiles per m (of ``box_index`` in x and in y)."""

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
    low, high = (pick(walls[:, :2], walls[:, 2:]) for pick in (np.minimum, np.maximum))
    start = np.zeros((rows, cols + 1), dtype=np.int64)
    items, total = [], 0
    for row, first in product(range(rows), range(0, cols, _BESIDE)):
        x_m = x0 + (np.arange(first, min(first + _BESIDE, cols)) + 0.5) * tile_m
        y_m = y0 + (row + 0.5) * tile_m
        near = np.flatnonzero(((high >= (x_m[0] - reach_m, y_m - reach_m))
                               & (low <= (x_m[-1] + reach_m, y_m + reach_m))).all(axis=1))
        centres = np.column_stack([x_m, np.full(len(x_m), y_m)])
        tile, wall = np.nonzero(point_distance(centres, walls[near]) <= reach_m)
        ends = total + np.searchsorted(tile, np.arange(len(x_m) + 1))
        start[row, first:first + len(ends)] = ends
        total += len(wall)
        items.append(near[wall])
    return TileIndex(start, np.concatenate(items).astype(np.int64),
                     np.array([x0, y0, 1.0 / tile_m]))


def box_index(walls: np.ndarray, tiles: int) -> TileIndex:
    """An index of about so many tiles over ``walls`` [n, 4]: for each tile, all of them whose
    bounding boxes come into it. Tiles need not be squares."""
    low, high = (pick(walls[:, :2], walls[:, 2:]) for pick in (np.minimum, np.maximum))
    corner_m = low.min(axis=0)
    extent_m = np.maximum(high.max(axis=0) - corner_m, 1e-3)
    edge_m = math.sqrt(extent_m.prod() / tiles)
    cols, rows = count = np.clip(np.rint(extent_m / edge_m), 1, tiles).astype(int)
    per_m = count / extent_m
    first, last = (np.clip(np.floor((ends - corner_m) * per_m), 0, count - 1).astype(int)
                   for ends in (low, high))
    wide, deep = (last - first + 1).T
    wall = np.repeat(np.arange(len(walls)), wide * deep)
    number = np.arange(len(wall)) - np.repeat(np.cumsum(wide * deep) - wide * deep, wide * deep)
    tile = (first[wall, 1] + number // wide[wall]) * cols + first[wall, 0] + number % wide[wall]
    order = np.argsort(tile, kind="stable")
    bounds = np.searchsorted(tile[order], np.arange(rows * cols + 1))
    start = np.column_stack([bounds[:-1].reshape(rows, cols), bounds[cols::cols]])
    return TileIndex(start, wall[order], np.concatenate([corner_m, per_m]))


def one_tile(walls: np.ndarray) -> TileIndex:
    """``box_index`` with a single tile: it has all of ``walls`` [n, 4], wherever a line is."""
    return TileIndex(np.array([[0, len(walls)]]), np.arange(len(walls)), np.zeros(4))
