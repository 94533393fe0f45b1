"""Contacts of convex polygons with walls, raster cells, discs and each other.

A polygon is its corners [k, 2] in m, anticlockwise; a wall is one of two corners, and a raster cell
one of four. Two of them overlap by the shortest way along a normal of one of their sides by which
one gets out of the other (separating axes: Gottschalk, Lin, Manocha 1996). A contact is
(depth m, unit vector x, y by which the first gets out), of depth 0 where there is none.
"""

import math
from typing import NamedTuple

import numpy as np

from desim.ports.kernels import cos, inner, lean, sin, types
from desim.world.kernels.contact import BARRIERS, against_wall, deeper

_f8, _i8, _f8x2 = types.float64, types.int64, types.float64[:, ::1]
_ROWS = types.Array(types.float64, 2, "C", readonly=True)
_CONTACT = types.UniTuple(types.float64, 3)
NONE = (0.0, 0.0, 0.0)


class Polygons(NamedTuple):
    """``corners`` [k, 2] m of all robots, anticlockwise, in their own frames; those of robot r are
    from ``first[r]`` to ``first[r + 1]``: a disc has none | ``placed`` [k, 2] m: on the ground"""

    corners: np.ndarray
    first: np.ndarray
    placed: np.ndarray


POLYGONS = types.NamedTuple([_f8x2, types.int64[::1], _f8x2], Polygons)


@inner(types.void(_ROWS, _i8, POLYGONS))
def place(poses, robot, polygons):
    """Put the corners of a robot to where they are on the ground. poses [n, 3]"""
    corners, first, placed = polygons
    x, y = poses[robot, 0], poses[robot, 1]
    c, s = cos(poses[robot, 2]), sin(poses[robot, 2])
    for i in range(first[robot], first[robot + 1]):
        placed[i, 0] = x + c * corners[i, 0] - s * corners[i, 1]
        placed[i, 1] = y + s * corners[i, 0] + c * corners[i, 1]


@lean(types.void(_ROWS, POLYGONS))
def place_all(poses, polygons):
    """``place`` all robots."""
    for r in range(len(polygons.first) - 1):
        place(poses, r, polygons)


@inner(_CONTACT(_ROWS, _ROWS, _f8))
def shortest_exit(p, q, least):
    """The least depth below ``least`` by which q reaches behind a side of p, and the side's normal
    to the outside; not above 0 where a side has all of q before it."""
    nx, ny, last = 0.0, 0.0, len(p) - 1
    for i in range(len(p)):
        x, y = p[last, 0], p[last, 1]
        ex, ey = p[i, 0] - x, p[i, 1] - y
        length = math.sqrt(ex * ex + ey * ey)
        ux, uy = ey / length, -ex / length
        depth = -np.inf
        for k in range(len(q)):
            depth = max(depth, ux * (x - q[k, 0]) + uy * (y - q[k, 1]))
        if depth < least:
            least, nx, ny = depth, ux, uy
            if least <= 0.0:
                break
        last = i
    return least, nx, ny


@lean(_CONTACT(_ROWS, _ROWS, _CONTACT))
def overlap(p, q, worst):
    """The deeper of ``worst`` and the contact of polygon p with polygon q."""
    depth, nx, ny = shortest_exit(p, q, np.inf)
    if depth <= worst[0]:
        return worst
    by_q, qx, qy = shortest_exit(q, p, depth)
    if by_q < depth:
        depth, nx, ny = by_q, -qx, -qy
    return (depth, -nx, -ny) if depth > worst[0] else worst


@lean(_CONTACT(_f8x2, _f8, _f8, _f8, _CONTACT))
def against_disc(p, x, y, radius, worst):
    """The deeper of ``worst`` and the contact of polygon p with a disc around (x, y)."""
    near_x, near_y, near2 = 0.0, 0.0, np.inf
    inside, nx, ny = np.inf, 0.0, 0.0  # the way from the centre to the nearest side, and its normal
    last = len(p) - 1
    for i in range(len(p)):
        ex, ey = p[i, 0] - p[last, 0], p[i, 1] - p[last, 1]
        dx, dy = x - p[last, 0], y - p[last, 1]
        length2 = ex * ex + ey * ey
        behind = (ex * dy - ey * dx) / math.sqrt(length2)
        if behind < inside:
            inside, nx, ny = behind, ey / math.sqrt(length2), -ex / math.sqrt(length2)
        along = min(max((dx * ex + dy * ey) / length2, 0.0), 1.0)
        ax, ay = p[last, 0] + along * ex - x, p[last, 1] + along * ey - y
        if ax * ax + ay * ay < near2:
            near_x, near_y, near2 = ax, ay, ax * ax + ay * ay
        last = i
    if inside >= 0.0:
        return (radius + inside, -nx, -ny) if radius + inside > worst[0] else worst
    return deeper(near_x, near_y, radius, worst)


@inner(_CONTACT(_f8x2, _f8, _f8, _f8, BARRIERS, _f8x2, _CONTACT))
def against_cells(p, x, y, radius, barriers, cell, worst):
    """The deeper of ``worst`` and the contacts of polygon p with solid cells. It lies in the disc
    of ``radius`` around (x, y). cell [4, 2]: to work in."""
    near, frame = barriers.near, barriers.frame
    side = 1.0 / frame[2]
    col, row, r = (x - frame[0]) * frame[2], (y - frame[1]) * frame[2], radius * frame[2]
    rows, cols = near.shape
    inside = 0 <= row < rows and 0 <= col < cols
    if inside and near[int(row), int(col)] > r + 1.0:
        return worst
    for i in range(max(math.floor(row - r), 0), min(math.floor(row + r) + 1, rows)):
        for j in range(max(math.floor(col - r), 0), min(math.floor(col + r) + 1, cols)):
            if near[i, j] == 0:
                left, low = frame[0] + j * side, frame[1] + i * side
                cell[0, 0], cell[0, 1], cell[1, 0], cell[1, 1] = left, low, left + side, low
                cell[2, 0], cell[2, 1] = left + side, low + side
                cell[3, 0], cell[3, 1] = left, low + side
                worst = overlap(p, cell, worst)
    return worst


@inner(_CONTACT(_f8x2, _f8, _f8, _f8, _ROWS, _i8, _f8x2, _CONTACT))
def against_line(p, x, y, radius, walls, w, cell, worst):
    """The deeper of ``worst`` and the contact of polygon p with wall w; the rest as in
    ``against_cells``."""
    if against_wall(x, y, radius, walls, w, NONE)[0] == 0.0:
        return worst
    line = cell[:2]
    line[0, 0], line[0, 1], line[1, 0], line[1, 1] = (walls[w, 0], walls[w, 1], walls[w, 2],
                                                      walls[w, 3])
    return overlap(p, line, worst)


@inner(_CONTACT(_f8x2, *[_f8] * 4, BARRIERS, _f8x2))
def deepest(p, x, y, radius, clearance, barriers, cell):
    """The deepest contact of polygon p with barriers, as that of a disc (``contact.deepest``); the
    rest as in ``against_cells``."""
    worst = NONE
    walls, tops, discs = barriers.walls, barriers.tops, barriers.discs
    start, items, frame = barriers.tiles
    row = min(max(int((y - frame[1]) * frame[2]), 0), start.shape[0] - 1)
    col = min(max(int((x - frame[0]) * frame[2]), 0), start.shape[1] - 2)
    for j in range(start[row, col], start[row, col + 1]):
        if tops[items[j]] > clearance:
            worst = against_line(p, x, y, radius, walls, items[j], cell, worst)
    for w in range(barriers.indexed, walls.shape[0]):
        if tops[w] > clearance:
            worst = against_line(p, x, y, radius, walls, w, cell, worst)
    if len(barriers.near) > 0:
        worst = against_cells(p, x, y, radius, barriers, cell, worst)
    for d in range(discs.shape[0]):
        worst = against_disc(p, discs[d, 0], discs[d, 1], discs[d, 2], worst)
    return worst
