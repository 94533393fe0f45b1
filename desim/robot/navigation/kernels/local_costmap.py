"""Loops of the local layer: what the laser sees around the robot.

The layer is ``near2`` [n, n] float32: squared distance in m^2 from the centre of each cell to the
nearest point that the laser saw, in the frame that the robot had then (x forward, y left, row by
y, the robot in the middle). ``beams`` [k, 2] are cos and sin of each beam's angle. ``flat`` and
``frame``, one record of ``FRAME``, are the global costmap.
"""

from __future__ import annotations

import math

import numpy as np
from numba import from_dtype, njit, types

from desim.ports.kernels import cos, lean, sin
from desim.robot.navigation.kernels.search import LETHAL

FRAME = np.dtype([(name, "f8") for name in ("x_m", "y_m", "cell_m", "across", "rows")])
FAR2 = np.float32(1e6)

_MEMORY_S, _MEMORY_M = 2.0, 1.2  # how long, and how near, what left the view is remembered
_AHEAD_COS = 0.64  # who comes from the left has to be within 50 degrees of ahead to be yielded to

_frame = types.Array(from_dtype(FRAME), 1, "C")
_f8, _i8, _f4x2 = types.float64, types.int64, types.float32[:, ::1]
_f8x1, _f8x2, _u1x1 = _f8[::1], _f8[:, ::1], types.uint8[::1]


@lean(_i8(_f8, _f8, _frame))
def place(x, y, frame):
    """The place of a point in the padded costmap as one line, or -1 outside."""
    f = frame[0]
    column, row = int(np.floor((x - f.x_m) / f.cell_m)), int(np.floor((y - f.y_m) / f.cell_m))
    if 0 <= column < f.across - 2 and 0 <= row < f.rows - 2:
        return (row + 1) * f.across + column + 1
    return -1


@lean("b1(f8, f8, f8, f8, f4[:,::1], f4[::1])")
def stamp(x, y, cell_m, reach_m, near2, dx2):
    """A point into the layer; False if it is too far away to matter. dx2 [n]: room to work in."""
    size = near2.shape[0]
    middle = 0.5 * size - 0.5  # in cells, of the centre of cell 0
    if max(abs(x), abs(y)) > reach_m + (middle + 1.0) * cell_m:
        return False  # most points are; the divisions below would find it too
    c0 = max(int(np.ceil((x - reach_m) / cell_m + middle)), 0)
    c1 = min(int(np.floor((x + reach_m) / cell_m + middle)) + 1, size)
    r0 = max(int(np.ceil((y - reach_m) / cell_m + middle)), 0)
    r1 = min(int(np.floor((y + reach_m) / cell_m + middle)) + 1, size)
    if c0 >= c1 or r0 >= r1:
        return False
    for k in range(c1 - c0):
        dx = np.float32((c0 + k - middle) * cell_m - x)
        dx2[k] = dx * dx
    for row in range(r0, r1):
        dy2, line = np.float32(((row - middle) * cell_m - y)**2), near2[row, c0:c1]
        for k in range(c1 - c0):
            line[k] = min(line[k], dx2[k] + dy2)
    return True


@njit("void(f4[::1], f8[:,::1], f8, f8, f8, f4[:,::1])", cache=True)
def see(ranges, beams, no_return_m, cell_m, reach_m, near2):
    """A scan as the layer; distances above ``reach_m`` stay far.

    beams [n, 2] cos and sin of each beam's angle | a range of ``no_return_m`` or more met nothing
    """
    near2[:] = FAR2
    last_x, last_y, dx2 = 1e9, 1e9, np.empty(len(near2), np.float32)
    for b in range(len(ranges)):
        r = float(ranges[b])
        if not 0.0 < r < no_return_m:
            continue
        x, y = r * beams[b, 0], r * beams[b, 1]
        if (x - last_x)**2 + (y - last_y)**2 < (0.3 * cell_m)**2:
            continue  # as good as the point before
        if stamp(x, y, cell_m, reach_m, near2, dx2):
            last_x, last_y = x, y


@njit(_i8(types.float32[::1], _f8x2, _f8x1, _f8, _f8, _f8, _f8x2, _i8, _f4x2), cache=True)
def remember(ranges, beams, pose, now_s, cell_m, reach_m, memory, count, near2):
    """What was seen near by a moment ago and is out of view now, into the layer as well: a robot
    that turns must not forget what it turned away from.

    memory [most, 3] x, y on the map and the time of sight | count: points in it. Returns how many
    are in it now.
    """
    c, s, kept, dx2 = cos(pose[2]), sin(pose[2]), 0, np.empty(len(near2), np.float32)
    widest = min(beams[0, 0], beams[len(beams) - 1, 0])  # cosine of the edge of the view
    for k in range(count):
        dx, dy = memory[k, 0] - pose[0], memory[k, 1] - pose[1]
        x, y = c * dx + s * dy, c * dy - s * dx
        r2 = x * x + y * y
        if now_s - memory[k, 2] < _MEMORY_S and r2 < _MEMORY_M**2 and x < widest * math.sqrt(r2):
            stamp(x, y, cell_m, reach_m, near2, dx2)
            memory[kept] = memory[k]
            kept += 1
    for b in range(0, len(ranges), 2):
        r = float(ranges[b])
        if 0.0 < r < _MEMORY_M and kept < len(memory):
            x, y = r * beams[b, 0], r * beams[b, 1]
            memory[kept, 0], memory[kept, 1] = pose[0] + c * x - s * y, pose[1] + s * x + c * y
            memory[kept, 2] = now_s
            kept += 1
    return kept


@lean(_f8(types.float32[::1], _f8x2, _f8x1, _f8, _u1x1, _frame))
def yield_to(ranges, beams, pose, within_m, flat, frame):
    """Distance in m to the nearest thing that moves, perhaps, and has the right of way: it is on
    no known obstacle, ahead or to the right. Looks ``within_m`` far; ``pose`` as of the scan."""
    across, nearest = int(frame[0].across), within_m
    c, s = cos(pose[2]), sin(pose[2])
    for b in range(len(ranges)):
        r = float(ranges[b])
        if not 0.0 < r < nearest or (beams[b, 0] < _AHEAD_COS and beams[b, 1] > 0.0):
            continue
        x, y = r * beams[b, 0], r * beams[b, 1]
        k = place(pose[0] + c * x - s * y, pose[1] + s * x + c * y, frame)
        if k < 0:
            continue
        known = False
        for row in range(-1, 2):
            for column in range(-1, 2):
                known = known or flat[k + row * across + column] == LETHAL
        if not known:
            nearest = r
    return nearest


@lean(types.Tuple((_i8, _f8))(types.float32[::1], _f8x2, _f8, _f8, _f8, _f8, _f8, _f8x1, _u1x1,
                              _frame, _f8x2, _i8, _f4x2))
def look(ranges, beams, no_return_m, now_s, cell_m, reach_m, yield_m, pose, flat, frame, memory,
         count, near2):
    """All that a scan is looked at for: ``see``, ``remember`` and ``yield_to`` in one call.
    Returns what the last two do."""
    see(ranges, beams, no_return_m, cell_m, reach_m, near2)
    count = remember(ranges, beams, pose, now_s, cell_m, reach_m, memory, count, near2)
    return count, yield_to(ranges, beams, pose, yield_m, flat, frame)


@lean("f8(f4[:,::1], f8, f8, f8)")
def clearance2(near2, cell_m, x, y):
    """Squared distance in m^2 to the nearest point seen, far outside the layer."""
    size = near2.shape[0]
    column, row = int(np.floor(x / cell_m + 0.5 * size)), int(np.floor(y / cell_m + 0.5 * size))
    if 0 <= column < size and 0 <= row < size:
        return float(near2[row, column])
    return float(FAR2)
