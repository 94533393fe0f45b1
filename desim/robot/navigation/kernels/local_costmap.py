"""Loops of the local costmap.

``near2`` [n, n] float32 is the squared distance in m^2 from the centre of each cell to the nearest
point that the laser saw, in the frame that the robot had then (x forward, y left, row by y, the
robot in the middle). ``scan`` and ``layer`` are one record each of ``SCAN`` and ``LAYER``.
``beams`` [k, 2] are cos and sin of each beam's angle. ``flat``, ``frame``: the global costmap.

These loops run for each robot at 5 to 10 Hz. Their arrays are plain arguments: numba's dispatcher
takes 2 to 3 us more for two NamedTuples, twice the present overhead of a call.
"""

import math

import numpy as np

from desim.ports.kernels import cos, from_dtype, inner, kernel, lean, sin, types
from desim.robot.navigation.kernels.global_costmap import FRAME_ARRAY, LETHAL, place

# The last scan: the robot's pose on the map then, its instant, the range from which on a beam met
# nothing, and the cosine of the angle from ahead up to which both sides are in view.
SCAN = np.dtype([(name, "f8") for name in ("x_m", "y_m", "yaw_rad", "time_s", "no_return_m",
                                           "edge_cos")])
# The width of a cell, the range of exact distances, and the distance up to which the robot yields;
# of the last scan: the distance to what has the right of way, the speed at which it approaches,
# where and when that was seen, and the number of remembered points.
LAYER = np.dtype([(name, "f8") for name in (
    "cell_m", "reach_m", "within_m", "yield_m", "come_mps", "x_m", "y_m", "time_s")]
                 + [("remembered", "i8")])
FAR2 = np.float32(1e6)

# Tuned; ``maze_8`` as in desim/robot/navigation/__init__.py.
_MEMORY_S = 2.0  # time for which a point that left the view is remembered; maze_8: 214, 197 s
_MEMORY_M = 1.2  # greatest distance of such a point; maze_8: 194, 199 s
# The robot yields to what is on its left only within 50 degrees of ahead; maze_8: 195, 176 s.
_AHEAD_COS = 0.64
_NEWS_S = 0.5  # an older distance does not count for the speed of approach (scans come at 5 Hz)

SCAN_ARRAY = types.Array(from_dtype(SCAN), 1, "C")
LAYER_ARRAY = types.Array(from_dtype(LAYER), 1, "C")
_f4x1, _f4x2 = types.float32[::1], types.float32[:, ::1]
_f8x2, _u1x1 = types.float64[:, ::1], types.uint8[::1]


@inner("f8(f8, f8, f4[:,::1])")
def farthest(cell_m, reach_m, near2):
    """The distance along x or y from which on a point is too far away to matter, or a little more.
    """
    return reach_m + (0.5 * near2.shape[0] + 0.5) * cell_m


@inner("b1(f8, f8, f8, f8, f4[:,::1], f4[::1])")
def stamp(x, y, cell_m, reach_m, near2, dx2):
    """Mark a point in the layer; False if it is too far away to matter. dx2 [n]: to work in.

    All rows are as wide as a multiple of eight cells, if the layer is: vector instructions leave no
    rest. The cells added are at ``FAR2``, which no minimum takes.
    """
    size = near2.shape[0]
    middle = 0.5 * size - 0.5  # in cells, of the centre of cell 0
    c0 = max(int(np.ceil((x - reach_m) / cell_m + middle)), 0)
    c1 = min(int(np.floor((x + reach_m) / cell_m + middle)) + 1, size)
    r0 = max(int(np.ceil((y - reach_m) / cell_m + middle)), 0)
    r1 = min(int(np.floor((y + reach_m) / cell_m + middle)) + 1, size)
    if c0 >= c1 or r0 >= r1:
        return False
    width = min(c1 - c0 + 7 & -8, size)
    first = min(c0, size - width)
    for k in range(width):
        dx2[k] = FAR2
    for k in range(c1 - c0):
        dx = np.float32((c0 + k - middle) * cell_m - x)
        dx2[np.uint64(c0 - first) + np.uint64(k)] = dx * dx
    row = r0
    while row < r1:  # ``range`` has seven instructions more here
        dy2 = np.float32(((row - middle) * cell_m - y)**2)
        for k in range(np.uint64(width)):
            cell = np.uint64(first) + k
            near2[np.uint64(row), cell] = min(near2[np.uint64(row), cell], dx2[k] + dy2)
        row += 1
    return True


@kernel(types.void(_f4x1, _f8x2, SCAN_ARRAY, LAYER_ARRAY, _f4x2), inner=True)
def mark(ranges, beams, scan, layer, near2):
    """Mark the points of a scan in the empty layer; distances above ``reach_m`` stay far."""
    no_return_m, cell_m, reach_m = scan[0].no_return_m, layer[0].cell_m, layer[0].reach_m
    near2[:] = FAR2
    last_x, last_y, dx2 = 1e9, 1e9, np.empty(len(near2), np.float32)
    far_m = farthest(cell_m, reach_m, near2)
    for b in range(len(ranges)):
        r = float(ranges[b])
        if not 0.0 < r < no_return_m:
            continue
        x, y = r * beams[b, 0], r * beams[b, 1]
        if max(abs(x), abs(y)) > far_m:
            continue  # as most points are; ``stamp`` would find it too
        if (x - last_x)**2 + (y - last_y)**2 < (0.3 * cell_m)**2:
            continue  # as good as the point before
        if stamp(x, y, cell_m, reach_m, near2, dx2):
            last_x, last_y = x, y


@kernel(types.void(_f4x1, _f8x2, SCAN_ARRAY, LAYER_ARRAY, _f8x2, _f4x2), inner=True)
def remember(ranges, beams, scan, layer, memory, near2):
    """Mark the points that were seen nearby a moment ago and are out of view now: a robot that
    turns must remember obstacles behind it. ``memory`` [most, 3]: x, y on the map, the instant."""
    cell_m, reach_m, here, now_s = layer[0].cell_m, layer[0].reach_m, scan[0], scan[0].time_s
    c, s, kept, dx2 = cos(here.yaw_rad), sin(here.yaw_rad), 0, np.empty(len(near2), np.float32)
    for k in range(layer[0].remembered):
        dx, dy = memory[k, 0] - here.x_m, memory[k, 1] - here.y_m
        x, y = c * dx + s * dy, c * dy - s * dx
        r2 = x * x + y * y
        if (now_s - memory[k, 2] < _MEMORY_S and r2 < _MEMORY_M**2
                and x < here.edge_cos * math.sqrt(r2)):
            stamp(x, y, cell_m, reach_m, near2, dx2)
            for i in range(3):
                memory[kept, i] = memory[k, i]
            kept += 1
    for b in range(0, len(ranges), 2):
        r = float(ranges[b])
        if 0.0 < r < _MEMORY_M and kept < len(memory):
            x, y = r * beams[b, 0], r * beams[b, 1]
            memory[kept, 0] = here.x_m + c * x - s * y
            memory[kept, 1] = here.y_m + s * x + c * y
            memory[kept, 2] = now_s
            kept += 1
    layer[0].remembered = kept


@inner(types.float64(_f4x1, _f8x2, SCAN_ARRAY, types.float64, _u1x1, FRAME_ARRAY))
def yield_to(ranges, beams, scan, within_m, flat, frame):
    """The distance in m, at most ``within_m``, to the nearest point that may move and has the right
    of way: a point on no known obstacle, ahead or to the right."""
    across, nearest, here = int(frame[0].across), within_m, scan[0]
    c, s = cos(here.yaw_rad), sin(here.yaw_rad)
    for b in range(len(ranges)):
        r = float(ranges[b])
        if not 0.0 < r < nearest or (beams[b, 0] < _AHEAD_COS and beams[b, 1] > 0.0):
            continue
        x, y = r * beams[b, 0], r * beams[b, 1]
        k = place(here.x_m + c * x - s * y, here.y_m + s * x + c * y, frame)
        if k < 0:
            continue
        known = False
        for row in range(-1, 2):
            for column in range(-1, 2):
                known = known or flat[k + row * across + column] == LETHAL
        if not known:
            nearest = r
    return nearest


@inner(types.void(SCAN_ARRAY, LAYER_ARRAY, types.float64))
def approach(scan, layer, yield_m):
    """Note the distance to the point that has the right of way, and its speed of approach: by how
    much it came nearer since the last scan, without the distance that the robot itself drove."""
    here, last = scan[0], layer[0]
    moved_m = math.sqrt((here.x_m - last.x_m)**2 + (here.y_m - last.y_m)**2)
    passed_s, came_m = here.time_s - last.time_s, last.yield_m - yield_m - moved_m
    last.come_mps = max(came_m, 0.0) / passed_s if 0.0 < passed_s < _NEWS_S else 0.0
    last.yield_m, last.x_m, last.y_m, last.time_s = yield_m, here.x_m, here.y_m, here.time_s


@lean(types.void(_f4x1, _f8x2, *[types.float64] * 6, SCAN_ARRAY, LAYER_ARRAY, _u1x1, FRAME_ARRAY,
                 _f8x2, _f4x2))
def observe(ranges, beams, x_m, y_m, yaw_rad, time_s, no_return_m, edge_cos, scan, layer, flat,
            frame, memory, near2):
    """Take in a scan, which becomes the last one: mark its points and those remembered, and find
    what has the right of way. (See ``dynamic_window.steer`` for why there are numbers.)"""
    here = scan[0]
    here.x_m, here.y_m, here.yaw_rad, here.time_s = x_m, y_m, yaw_rad, time_s
    here.no_return_m, here.edge_cos = no_return_m, edge_cos
    mark(ranges, beams, scan, layer, near2)
    remember(ranges, beams, scan, layer, memory, near2)
    approach(scan, layer, yield_to(ranges, beams, scan, layer[0].within_m, flat, frame))


@inner("f8(f4[:,::1], f8, f8, f8)")
def clearance2(near2, cell_m, x, y):
    """Squared distance in m^2 to the nearest point seen; ``FAR2`` outside of the layer."""
    size = near2.shape[0]
    column, row = x / cell_m + 0.5 * size, y / cell_m + 0.5 * size
    if 0.0 <= column < size and 0.0 <= row < size:  # so int() is the floor, without a call
        return float(near2[np.uint64(int(row)), np.uint64(int(column))])
    return float(FAR2)
