"""Loops that turn a scan into evidence: the cells that it found occupied and free.

A cell is one number: ``tile * 1024 + (row % 32) * 32 + (column % 32)``.
"""

from typing import NamedTuple

import numpy as np
from numba import from_dtype, njit, types

from desim.ports.kernels import cos, lean, sin
from desim.robot.kernels.tiles import FREE, FUSED, HIT, MISS, OCCUPIED, POOL, make_own

# Evidence is clamped to log-odds of -2.0 .. 3.5, in units of 0.05 nat (OctoMap, as ``HIT``).
CLAMP_LOW, CLAMP_HIGH = -40, 70
FIXED = 4294967296.0  # one, in the fixed point of ``walk``
DEPTH = 0.05  # cells; more than ranges err by rounding (float32), less than they err by noise


class Sheet(NamedTuple):
    """Arrays of all maps of one size: ``numbers`` [width + height], the number of a cell is
    ``numbers[column] + numbers[width + row]`` | ``marks`` [cells] | ``cells`` [cells + 1], out: the
    cells that a scan found."""

    numbers: np.ndarray
    marks: np.ndarray
    cells: np.ndarray


# A scan to take in, one record: the sensor's place and heading, its beams, the range from which on
# a beam met nothing and the one up to which it is used; the size of the map, and the number that
# marks this scan's cells. Lengths in cells; ``per_m`` cells make a metre.
SCAN = np.dtype([(name, "f8") for name in (
    "x", "y", "yaw_rad", "angle_min_rad", "increment_rad", "per_m", "no_return", "usable")]
    + [("width", "i8"), ("height", "i8"), ("stamp", "i8")])

_scan = types.Array(from_dtype(SCAN), 1, "C")
_sheet = types.NamedTuple([types.uint32[::1], types.uint8[::1], types.uint32[::1]], Sheet)
_f8, _u8, _f8x2 = types.float64, types.uint64, types.float64[:, ::1]


@lean("f8(f8, f8, i8)")
def rim(x, along_x, width):
    """The length of a line in this direction until it leaves [0, width)."""
    if along_x > 0.0:
        return (width - 1e-6 - x) / along_x
    return x / -along_x if along_x < 0.0 else np.inf


@lean("u8(u8, u1, u1[::1], u8, u4[::1])")
def put(cell, stamp, marks, count, cells):
    """Append ``cell`` to ``cells`` if it is not marked, and mark it. Without a branch, which would
    be hard to predict; the list needs room for one more than the grid has cells."""
    cells[count] = cell
    unmarked = marks[cell] != stamp
    marks[cell] = stamp
    return count + np.uint64(unmarked)


@lean(_u8(*[_f8] * 5, _u8, types.int64, types.int64, types.uint8, _sheet))
def walk(x, y, along_x, along_y, length, count, width, height, stamp, sheet):
    """Mark the cells on a line of ``length`` from (x, y) along a unit vector, up to the rim of the
    grid, and append those that had no mark to the ``count`` cells that are there. Returns their new
    count.

    The cells are the exact ones; where the line meets a corner, also one beside it. From column
    to column along the longer axis: first the row where the line leaves the column, in fixed point
    (32 bits behind the point), so that it is at most one row away.
    """
    numbers, marks, cells = sheet
    if not (0.0 <= x < width and 0.0 <= y < height):
        return count
    length = min(length, rim(x, along_x, width), rim(y, along_y, height))
    columns, rows = 0, width
    if abs(along_x) < abs(along_y):
        x, y, along_x, along_y, columns, rows = y, x, along_y, along_x, rows, columns
    step = 1 if along_x > 0.0 else -1
    slope = step * along_y / along_x
    edge = int(x) + (step + 1) // 2
    leave, climb = int((y + abs(edge - x) * slope) * FIXED), int(slope * FIXED)
    at = columns + int(x)
    count = put(numbers[at] + numbers[rows + int(y)], stamp, marks, count, cells)
    for _ in range(abs(int(x + along_x * length) - int(x))):
        row = numbers[rows + (leave >> 32)]
        count = put(numbers[at] + row, stamp, marks, count, cells)
        at += step
        leave += climb
        count = put(numbers[at] + row, stamp, marks, count, cells)
    last = numbers[rows + int(y + along_y * length)]
    return put(numbers[at] + last, stamp, marks, count, cells)


@lean(types.void(_f8x2, _f8x2, _u8, _scan, _sheet))
def keep_walls(ray, end, count, scan, sheet):
    """Mark the cells where a wall seems to go on: the line through the returns of two neighbouring
    beams, as far as the next beam. That beam, if it grazes the wall, runs through the wall's own
    cells before it meets or passes it, and must not erase them.

    With a, b the ends and u the direction of the next beam from o, b + s (b - a) = o + t u has the
    solution s = (o - b) x u / (b - a) x u.
    """
    x, y, no_return = scan[0].x, scan[0].y, scan[0].no_return
    width, height, stamp = scan[0].width, scan[0].height, np.uint8(scan[0].stamp)
    for b in range(1, len(ray) - 1):
        for side in (-1, 1):
            if ray[b, 2] >= no_return or ray[b - side, 2] >= no_return:
                continue
            wall_x, wall_y = end[b, 0] - end[b - side, 0], end[b, 1] - end[b - side, 1]
            next_x, next_y = ray[b + side, 0], ray[b + side, 1]
            across = wall_x * next_y - wall_y * next_x
            if across == 0.0:
                continue
            part = ((x - end[b, 0]) * next_y - (y - end[b, 1]) * next_x) / across
            ahead = ((end[b, 0] + part * wall_x - x) * next_x
                     + (end[b, 1] + part * wall_y - y) * next_y)
            length = np.sqrt(wall_x * wall_x + wall_y * wall_y)
            if ahead > 0.0 and part * length > 1.0:  # else the two cells touch
                walk(end[b, 0], end[b, 1], wall_x / length, wall_y / length, part * length, count,
                     width, height, stamp, sheet)


@njit(types.UniTuple(types.int64, 2)(types.float32[::1], _scan, _sheet), cache=True)
def sweep(ranges, scan, sheet):
    """The evidence of one scan: ``sheet.cells[:hits]`` are occupied, ``[hits:count]`` free, each
    at most once. Returns (hits, count); ``ranges`` in m.

    A return belongs to the matter behind the face that it came from, also where that face lies on
    the line between two cells: it is taken to be ``DEPTH`` farther away.

    Hits first. Then the continuations of walls (``keep_walls``), which are left as they are, and
    then the misses along the beams.
    """
    s = scan[0]
    x, y, no_return, usable, width, height = s.x, s.y, s.no_return, s.usable, s.width, s.height
    stamp = np.uint8(s.stamp)
    numbers, marks, cells = sheet
    beams, count = len(ranges), np.uint64(0)
    ray, end = np.empty((beams, 3)), np.empty((beams, 2))
    for b in range(beams):
        angle = s.yaw_rad + s.angle_min_rad + b * s.increment_rad
        ray[b, 0], ray[b, 1], ray[b, 2] = cos(angle), sin(angle), ranges[b] * s.per_m
        if ray[b, 2] < no_return:
            ray[b, 2] += DEPTH
        end[b, 0], end[b, 1] = x + ray[b, 0] * ray[b, 2], y + ray[b, 1] * ray[b, 2]
        if (ray[b, 2] < min(usable, no_return) and 0.0 <= end[b, 0] < width
                and 0.0 <= end[b, 1] < height):
            count = put(numbers[int(end[b, 0])] + numbers[width + int(end[b, 1])], stamp, marks,
                        count, cells)
    hits = count
    keep_walls(ray, end, count, scan, sheet)
    for b in range(beams):
        count = walk(x, y, ray[b, 0], ray[b, 1], min(ray[b, 2], usable), count, width, height,
                     stamp, sheet)
    return hits, count


@lean(types.int64(types.uint32[::1], *[types.int64] * 3, types.int32[::1], POOL, FUSED))
def add_evidence(cells, amount, version, count, indices, pool, total):
    """Add ``amount`` to ``cells`` of the layer ``indices`` and to the sum, whose version this is.
    Returns the number of tiles in ``total.changed``, which was ``count``. A cell at its clamp
    already changes nothing."""
    data, refs = pool.data, pool.refs
    fused, tile_version, changed = total
    for k in range(len(cells)):
        cell = np.int64(cells[k])
        tile, place = cell >> 10, cell & 1023
        old = data[indices[tile], place]
        new = min(max(old + amount, CLAMP_LOW), CLAMP_HIGH)
        if new != old:
            if indices[tile] == 0 or refs[indices[tile]] != 1:
                make_own(tile, indices, pool)
            data[indices[tile], place] = new
            before = fused[tile, place]
            after = before + new - old
            fused[tile, place] = after
            turned = ((before <= FREE) != (after <= FREE)
                      or (before >= OCCUPIED) != (after >= OCCUPIED))
            if turned and tile_version[tile] != version:
                tile_version[tile] = version
                changed[count] = tile
                count += 1
    return count


@njit(types.int64(types.float32[::1], _scan, _sheet, types.int64, types.int32[::1], POOL, FUSED),
      cache=True)
def integrate(ranges, scan, sheet, version, indices, pool, total):
    """Add the evidence of a scan to the layer ``indices`` and to the sum, whose version this is.
    Returns the number of tiles in ``total.changed``."""
    hits, count = sweep(ranges, scan, sheet)
    changed = add_evidence(sheet.cells[:hits], HIT, version, 0, indices, pool, total)
    return add_evidence(sheet.cells[hits:count], MISS, version, changed, indices, pool, total)
