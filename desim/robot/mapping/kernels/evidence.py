"""Loops that turn a scan into evidence: the cells that it found occupied and free.

A cell is one number: ``tile * 1024 + (row % 32) * 32 + (column % 32)``.
"""

from typing import NamedTuple

import numpy as np

from desim.ports.kernels import cos, from_dtype, inner, kernel, sin, types
from desim.robot.mapping.kernels.tiles import FUSED, HIT, MISS, POOL, add, make_own, note_rows

# Evidence is clamped to log-odds of -2.0 .. 3.5, in units of 0.05 nat (OctoMap, as ``HIT``).
CLAMP_LOW, CLAMP_HIGH = -40, 70
FIXED = 4294967296.0  # one, in the fixed point of ``walk``
DEPTH = 0.05  # cells; more than ranges err by rounding (float32), less than they err by noise


class Sheet(NamedTuple):
    """Arrays of all maps of one size: ``numbers`` [width + height], the number of a cell is
    ``numbers[column] + numbers[width + row]`` | ``marks`` [cells], the stamp of what a scan last
    found there | ``difference`` [1024], what a scan changes of a tile's evidence, to work in."""

    numbers: np.ndarray
    marks: np.ndarray
    difference: np.ndarray


# A scan to take in, one record: the sensor's place and heading, its beams, the range from which on
# a beam met nothing and the one up to which it is used; the size of the map, and the stamp of this
# scan's hits. That of its misses is one more. A cell with evidence of ``spared`` or more is not
# cleared. Lengths in cells; ``per_m`` cells make a metre.
SCAN = np.dtype([(name, "f8") for name in (
    "x", "y", "yaw_rad", "angle_min_rad", "increment_rad", "per_m", "no_return", "usable")]
    + [("width", "i8"), ("height", "i8"), ("stamp", "i8"), ("spared", "i8")])

_scan = types.Array(from_dtype(SCAN), 1, "C")
_sheet = types.NamedTuple([types.uint32[::1], types.uint8[::1], types.int8[::1]], Sheet)
_f8, _i8, _f8x2 = types.float64, types.int64, types.float64[:, ::1]


@inner("f8(f8, f8, i8)")
def rim(x, along_x, width):
    """The length of a line in this direction until it leaves [0, width)."""
    if along_x > 0.0:
        return (width - 1e-6 - x) / along_x
    return x / -along_x if along_x < 0.0 else np.inf


@inner(types.void(*[_f8] * 5, _i8, _i8, types.uint8, _sheet))
def walk(x, y, along_x, along_y, length, width, height, stamp, sheet):
    """Stamp the cells on a line of ``length`` from (x, y) along a unit vector, up to the rim of the
    grid.

    The cells are the exact ones; where the line meets a corner, also one beside it. From column
    to column along the longer axis: first the row where the line leaves the column, in fixed point
    (32 bits behind the point), so that it is at most one row away. No step reads what another one
    writes, so that they overlap in time (a scan's lines: 20 us, with a list of new cells 76 us).
    """
    numbers, marks, _ = sheet
    if not (0.0 <= x < width and 0.0 <= y < height):
        return
    length = min(length, rim(x, along_x, width), rim(y, along_y, height))
    columns, rows = 0, width
    if abs(along_x) < abs(along_y):
        x, y, along_x, along_y, columns, rows = y, x, along_y, along_x, rows, columns
    step = 1 if along_x > 0.0 else -1
    slope = step * along_y / along_x
    edge = int(x) + (step + 1) // 2
    # Unsigned, as nothing here is below 0: numba then needs no test for that in each step.
    leave = np.uint64(int((y + abs(edge - x) * slope) * FIXED))
    climb = np.uint64(int(slope * FIXED))
    at, rows, stride = np.uint64(columns + int(x)), np.uint64(rows), np.uint64(step)
    column = numbers[at]
    marks[column + numbers[rows + np.uint64(int(y))]] = stamp
    for _ in range(abs(int(x + along_x * length) - int(x))):
        row = numbers[rows + (leave >> np.uint64(32))]
        marks[column + row] = stamp
        at += stride
        leave += climb
        column = numbers[at]
        marks[column + row] = stamp
    marks[column + numbers[rows + np.uint64(int(y + along_y * length))]] = stamp


@inner(types.void(_f8x2, _f8x2, _scan, _sheet))
def keep_walls(ray, end, scan, sheet):
    """Clear the cells where a wall seems to go on: the line through the returns of two neighbouring
    beams, as far as the next beam. That beam, if it grazes the wall, runs through the wall's own
    cells before it meets or passes it, and must not erase them.

    With a, b the ends and u the direction of the next beam from o, b + s (b - a) = o + t u has the
    solution s = (o - b) x u / (b - a) x u.
    """
    x, y, no_return = scan[0].x, scan[0].y, scan[0].no_return
    width, height = scan[0].width, scan[0].height
    for beam in range(1, len(ray) - 1):
        for side in (-1, 1):
            # Unsigned: numba then needs no test for < 0.
            b, last, following = np.uint64(beam), np.uint64(beam - side), np.uint64(beam + side)
            if ray[b, 2] >= no_return or ray[last, 2] >= no_return:
                continue
            wall_x, wall_y = end[b, 0] - end[last, 0], end[b, 1] - end[last, 1]
            next_x, next_y = ray[following, 0], ray[following, 1]
            across = wall_x * next_y - wall_y * next_x
            if across == 0.0:
                continue
            part = ((x - end[b, 0]) * next_y - (y - end[b, 1]) * next_x) / across
            ahead = ((end[b, 0] + part * wall_x - x) * next_x
                     + (end[b, 1] + part * wall_y - y) * next_y)
            length = np.sqrt(wall_x * wall_x + wall_y * wall_y)
            if ahead > 0.0 and part * length > 1.0:  # else the two cells touch
                walk(end[b, 0], end[b, 1], wall_x / length, wall_y / length, part * length, width,
                     height, np.uint8(0), sheet)


@inner("UniTuple(i8, 2)(f8, f8, f8, f8, i8)")
def reach(at, low, high, usable, size):
    """The first and the last of the columns (or rows) within ``usable`` of a sensor ``at``, and
    within the ends ``low`` and ``high`` of its beams, or one beside them."""
    first = max(min(low, at), at - usable) - 1.0
    last = min(max(high, at), at + usable) + 1.0
    return int(max(first, 0.0)), int(min(last, size - 1.0))


@kernel(types.UniTuple(_i8, 4)(types.float32[::1], _scan, _sheet), inner=True)
def sweep(ranges, scan, sheet):
    """Stamp the cells that a scan found occupied (its stamp) and free (one more). Returns the first
    and the last column and row with such cells, or a little more; ``ranges`` in m.

    A return belongs to the matter behind the face that it came from, also where that face lies on
    the line between two cells: it is taken to be ``DEPTH`` farther away.

    The later stamp counts: misses along the beams, then the continuations of walls
    (``keep_walls``), which are left as they are, and then hits.
    """
    s = scan[0]
    x, y, no_return, usable, width, height = s.x, s.y, s.no_return, s.usable, s.width, s.height
    hit = np.uint8(s.stamp)
    numbers, marks, _ = sheet
    beams = len(ranges)
    ray, end = np.empty((beams, 3)), np.empty((beams, 2))
    left, right, low, high = x, x, y, y
    for b in range(beams):
        angle = s.yaw_rad + s.angle_min_rad + b * s.increment_rad
        ray[b, 0], ray[b, 1], ray[b, 2] = cos(angle), sin(angle), ranges[b] * s.per_m
        if ray[b, 2] < no_return:
            ray[b, 2] += DEPTH
        end[b, 0], end[b, 1] = x + ray[b, 0] * ray[b, 2], y + ray[b, 1] * ray[b, 2]
        left, right = min(left, end[b, 0]), max(right, end[b, 0])
        low, high = min(low, end[b, 1]), max(high, end[b, 1])
        walk(x, y, ray[b, 0], ray[b, 1], min(ray[b, 2], usable), width, height,
             np.uint8(hit + 1), sheet)
    keep_walls(ray, end, scan, sheet)
    for b in range(beams):
        if (ray[b, 2] < min(usable, no_return) and 0.0 <= end[b, 0] < width
                and 0.0 <= end[b, 1] < height):
            marks[numbers[int(end[b, 0])] + numbers[width + int(end[b, 1])]] = hit
    first, last = reach(x, left, right, usable, width)
    bottom, top = reach(y, low, high, usable, height)
    return first, last, bottom, top


@inner("i1(i1, u1, u1, i1)")
def change(old, mark, hit, spared):
    """The change of a cell's evidence by a scan with this stamp of hits. Without a branch, and
    clamped as a number without sign: it becomes vector instructions that all processors have."""
    more = np.uint8(HIT) if mark == hit else np.uint8(0)
    less = np.uint8(-MISS) if mark == np.uint8(hit + 1) else np.uint8(0)
    less = less if old < spared else np.uint8(0)
    before = np.uint8(np.uint8(old) + np.uint8(128))
    after = max(np.uint8(np.uint8(before + more) - less), np.uint8(CLAMP_LOW + 128))
    return np.int8(np.uint8(min(after, np.uint8(CLAMP_HIGH + 128)) - before))


@inner("b1(u1[::1], u1, i1, u8, i1[::1], i1[::1])")
def weigh(marks, hit, spared, tile, evidence, difference):
    """Write what a scan changes of a tile's ``evidence`` to ``difference``. Returns whether that is
    anything: a cell at its clamp stays as it is."""
    changed, first = np.int8(0), tile << np.uint64(10)
    for c in range(np.uint64(1024)):
        by = change(evidence[c], marks[first + c], hit, spared)
        difference[c] = by
        changed = np.int8(changed | by)
    return changed != 0


@inner("void(i1[::1], i1[::1])")
def revise(difference, evidence):
    """Change a tile's evidence."""
    for c in range(1024):
        evidence[c] = np.int8(evidence[c] + difference[c])


@kernel(types.int64(types.float32[::1], _scan, _sheet, types.int64, types.int32[::1], POOL, FUSED))
def integrate(ranges, scan, sheet, version, indices, pool, total):
    """Add the evidence of a scan to the layer ``indices`` and to the sum, whose version this is.
    Returns the number of tiles in ``total.changed``."""
    first, last, bottom, top = sweep(ranges, scan, sheet)
    across, hit, count = (scan[0].width + 31) >> 5, np.uint8(scan[0].stamp), 0
    spared, difference = np.int8(scan[0].spared), sheet.difference
    for tile_row in range(bottom >> 5, (top >> 5) + 1):
        for tile in range(tile_row * across + (first >> 5), tile_row * across + (last >> 5) + 1):
            if not weigh(sheet.marks, hit, spared, tile, pool.data[indices[tile]], difference):
                continue
            make_own(tile, indices, pool)
            revise(difference, pool.data[indices[tile]])
            if add(difference, total.fused[tile]):
                total.tile_version[tile] = version
                note_rows(difference, version, total.fused[tile], total.row_version[tile])
                total.changed[count] = tile
                count += 1
    return count
