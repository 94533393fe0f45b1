"""Contacts of a disc with walls, raster cells and other discs: their depth, and the way out."""

import math
from typing import NamedTuple

import numpy as np

from desim.ports.kernels import inner, kernel, types
from desim.world.wall_index import TileIndex

_ROWS = types.Array(types.float64, 2, "C", readonly=True)
_DEPTH = types.UniTuple(types.float64, 3)


class Barriers(NamedTuple):
    """All that bodies can run into.

    ``walls`` [n, 4] m, the first ``indexed`` of them in the ``tiles``, and their heights ``tops``
    [n] m | ``near`` [rows, cols] the chessboard distance to the nearest solid cell, in cells, at
    most 255; no rows without a raster | ``frame`` of the cells: x0 m, y0 m, cells per m | ``discs``
    [d, 3] x, y, radius m
    """

    walls: np.ndarray
    tops: np.ndarray
    indexed: int
    tiles: TileIndex
    near: np.ndarray
    frame: np.ndarray
    discs: np.ndarray


BARRIERS = types.NamedTuple([
    _ROWS, types.float64[::1], types.int64,
    types.NamedTuple([types.int64[:, ::1], types.int64[::1], types.float64[::1]], TileIndex),
    types.uint8[:, ::1], types.float64[::1], _ROWS], Barriers)


@kernel(_DEPTH(types.float64, types.float64, types.float64, _DEPTH), inner=True)
def deeper(dx, dy, radius, worst):
    """The deeper of ``worst`` and a point of matter from which the disc's centre is (dx, dy) away.

    A contact is (depth m, unit vector to the outside x, y).
    """
    distance2 = dx * dx + dy * dy
    reach = radius - worst[0]
    if distance2 >= reach * reach or distance2 == 0.0 or reach <= 0.0:
        return worst
    distance = math.sqrt(distance2)
    return radius - distance, dx / distance, dy / distance


@inner(_DEPTH(types.float64, types.float64, types.float64, _ROWS, types.int64, _DEPTH))
def against_wall(x, y, radius, walls, w, worst):
    """The deeper of ``worst`` and the contact with wall w of walls [n, 4]."""
    x1, y1 = walls[w, 0], walls[w, 1]
    ex, ey = walls[w, 2] - x1, walls[w, 3] - y1
    along = ((x - x1) * ex + (y - y1) * ey) / (ex * ex + ey * ey)
    along = min(max(along, 0.0), 1.0)
    return deeper(x - x1 - along * ex, y - y1 - along * ey, radius, worst)


@inner(_DEPTH(types.float64, types.float64, types.float64, BARRIERS, _DEPTH))
def against_raster(x, y, radius, barriers, worst):
    """The deeper of ``worst`` and the contacts with solid cells."""
    near, frame = barriers.near, barriers.frame
    col, row = (x - frame[0]) * frame[2], (y - frame[1]) * frame[2]
    r = radius * frame[2]
    rows, cols = near.shape
    inside = 0 <= row < rows and 0 <= col < cols
    if inside and near[int(row), int(col)] > r + 1.0:
        return worst
    for i in range(max(math.floor(row - r), 0), min(math.floor(row + r) + 1, rows)):
        for j in range(max(math.floor(col - r), 0), min(math.floor(col + r) + 1, cols)):
            if near[i, j] == 0:
                dx = col - min(max(col, float(j)), j + 1.0)
                dy = row - min(max(row, float(i)), i + 1.0)
                worst = deeper(dx / frame[2], dy / frame[2], radius, worst)
    return worst


@inner(_DEPTH(*[types.float64] * 4, BARRIERS))
def deepest(x, y, radius, clearance, barriers):
    """The deepest contact of a disc with barriers; depth 0 if there is none. Walls up to
    ``clearance`` high do not count."""
    worst = (0.0, 0.0, 0.0)
    walls, tops, discs = barriers.walls, barriers.tops, barriers.discs
    start, items, frame = barriers.tiles
    row = min(max(int((y - frame[1]) * frame[2]), 0), start.shape[0] - 1)
    col = min(max(int((x - frame[0]) * frame[2]), 0), start.shape[1] - 2)
    for j in range(start[row, col], start[row, col + 1]):
        if tops[items[j]] > clearance:
            worst = against_wall(x, y, radius, walls, items[j], worst)
    for w in range(barriers.indexed, walls.shape[0]):
        if tops[w] > clearance:
            worst = against_wall(x, y, radius, walls, w, worst)
    if len(barriers.near) > 0:
        worst = against_raster(x, y, radius, barriers, worst)
    for d in range(discs.shape[0]):
        worst = deeper(x - discs[d, 0], y - discs[d, 1], radius + discs[d, 2], worst)
    return worst
