"""Loops of the local planner ``orca``: half-planes of velocities, and the best velocity in them.

J. van den Berg, S. J. Guy, M. Lin, D. Manocha, "Reciprocal n-body collision avoidance", ISRR 2009
(Springer 2011): half-planes by its section 4, linear programmes by its section 5. A half-plane is a
row of ``planes`` [n, 4]: a point of its edge (x, y) and the normal towards what is allowed.
"""

import math

import numpy as np

from desim.ports.kernels import kernel, types

_PARALLEL = 1e-5  # the sine between two edges below which they count as parallel

_f8, _f8x2 = types.float64, types.float64[:, ::1]


@kernel("UniTuple(f8, 4)(f8, f8, f8, f8, f8, f8, f8)", inner=True)
def out_of_obstacle(px, py, vx, vy, radius, horizon_s, step_s):
    """The least change (x, y) of the relative velocity (vx, vy) that takes it to the edge of the
    velocity obstacle of a disc of ``radius`` at (px, py) within ``horizon_s``, and the edge's
    normal there. Discs that overlap get apart within ``step_s``."""
    p2, r2 = px * px + py * py, radius * radius
    time_s = horizon_s if p2 > r2 else step_s
    wx, wy = vx - px / time_s, vy - py / time_s  # from the middle of the cut-off disc
    w2, along = wx * wx + wy * wy, wx * px + wy * py
    if p2 <= r2 or (along < 0.0 and along * along > r2 * w2):  # its round end
        w = math.sqrt(w2)
        nx, ny = (wx / w, wy / w) if w > 1e-12 else (-px / math.sqrt(p2 + 1e-12),
                                                     -py / math.sqrt(p2 + 1e-12))
        far = radius / time_s - w
        return far * nx, far * ny, nx, ny
    leg = math.sqrt(p2 - r2)
    if px * wy - py * wx > 0.0:  # its left side
        dx, dy = (px * leg - py * radius) / p2, (px * radius + py * leg) / p2
    else:
        dx, dy = -(px * leg + py * radius) / p2, -(py * leg - px * radius) / p2
    along = vx * dx + vy * dy
    return along * dx - vx, along * dy - vy, -dy, dx


@kernel("UniTuple(f8, 3)(f8[:,::1], i8, f8, f8, f8, b1)", inner=True)
def best_on_edge(planes, i, speed, wx, wy, by_direction):
    """1.0 and the best velocity on the edge of half-plane ``i`` that is in those before it and in
    the disc of ``speed``, or 0.0 if there is none. The best is the nearest to (wx, wy), or the
    farthest in this direction."""
    px, py, dx, dy = planes[i, 0], planes[i, 1], planes[i, 3], -planes[i, 2]
    along = px * dx + py * dy
    root2 = along * along + speed * speed - px * px - py * py
    if root2 < 0.0:
        return 0.0, 0.0, 0.0
    low, high = -along - math.sqrt(root2), -along + math.sqrt(root2)
    for k in range(i):
        slope = dx * planes[k, 2] + dy * planes[k, 3]
        room = (px - planes[k, 0]) * planes[k, 2] + (py - planes[k, 1]) * planes[k, 3]
        if abs(slope) <= _PARALLEL:
            if room < 0.0:
                return 0.0, 0.0, 0.0
        elif slope > 0.0:
            low = max(low, -room / slope)
        else:
            high = min(high, -room / slope)
        if low > high:
            return 0.0, 0.0, 0.0
    if by_direction:
        t = high if wx * dx + wy * dy > 0.0 else low
    else:
        t = min(max((wx - px) * dx + (wy - py) * dy, low), high)
    return 1.0, px + t * dx, py + t * dy


@kernel("Tuple((i8, f8, f8))(f8[:,::1], i8, f8, f8, f8, b1)", inner=True)
def best_velocity(planes, count, speed, wx, wy, by_direction):
    """The best velocity in ``count`` half-planes and the disc of ``speed``, one plane after the
    other; and the first plane without one, or ``count``."""
    w = math.sqrt(wx * wx + wy * wy)
    scale = speed / w if w > 0.0 and (by_direction or w > speed) else 1.0
    x, y = scale * wx, scale * wy
    for i in range(count):
        if (x - planes[i, 0]) * planes[i, 2] + (y - planes[i, 1]) * planes[i, 3] < 0.0:
            found, next_x, next_y = best_on_edge(planes, i, speed, wx, wy, by_direction)
            if found == 0.0:
                return i, x, y
            x, y = next_x, next_y
    return count, x, y


@kernel("UniTuple(f8, 2)(f8[:,::1], i8, i8, i8, f8, f8, f8)", inner=True)
def safest_velocity(planes, hard, first, count, speed, x, y):
    """The velocity that is deepest in, or least outside of, the half-planes from ``hard`` on, and
    in all those before (a linear programme in three dimensions, by projection)."""
    deep, work = 0.0, np.empty((count, 4))
    for i in range(first, count):
        px, py, nx, ny = planes[i, 0], planes[i, 1], planes[i, 2], planes[i, 3]
        if (px - x) * nx + (py - y) * ny <= deep:
            continue
        for j in range(hard):  # a slice would need numba's library, for its errors
            for k in range(4):
                work[j, k] = planes[j, k]
        rows = hard
        for j in range(hard, i):  # where plane i is violated as much as plane j
            mx, my = planes[j, 2] - nx, planes[j, 3] - ny
            m = math.sqrt(mx * mx + my * my)
            turn = nx * planes[j, 3] - ny * planes[j, 2]
            if abs(turn) <= _PARALLEL:
                if nx * planes[j, 2] + ny * planes[j, 3] > 0.0:
                    continue
                qx, qy = 0.5 * (px + planes[j, 0]), 0.5 * (py + planes[j, 1])
            else:
                gap = (planes[j, 0] - px) * planes[j, 2] + (planes[j, 1] - py) * planes[j, 3]
                qx, qy = px - gap / turn * ny, py + gap / turn * nx
            work[rows, 0], work[rows, 1], work[rows, 2], work[rows, 3] = qx, qy, mx / m, my / m
            rows += 1
        solved, next_x, next_y = best_velocity(work, rows, speed, nx, ny, True)
        if solved == rows:  # always, but for rounding
            x, y = next_x, next_y
        deep = (px - x) * nx + (py - y) * ny
    return x, y


@kernel("UniTuple(f8, 2)(f8[:,::1], i8, f8, f8, f8)")
def solve(planes, hard, speed, wx, wy):
    """The velocity nearest to (wx, wy) in all half-planes and in the disc of ``speed``. Where there
    is none: the safest one; the first ``hard`` planes hold in any case."""
    count = len(planes)
    solved, x, y = best_velocity(planes, count, speed, wx, wy, False)
    if solved < count:
        return safest_velocity(planes, hard, max(solved, hard), count, speed, x, y)
    return x, y


@kernel("void(f8[:,::1], f8, f8, f8, f8, f8, f8[:,::1])")
def reciprocal(others, vx, vy, radius, horizon_s, step_s, planes):
    """Write the half-plane of each of ``others`` [n, 5] (place and velocity x, y from the disc of
    ``radius`` with velocity (vx, vy), and radius): each takes half of the change."""
    for i in range(len(others)):
        o = others[i]
        ux, uy, nx, ny = out_of_obstacle(o[0], o[1], vx - o[2], vy - o[3], radius + o[4],
                                         horizon_s, step_s)
        planes[i, 0], planes[i, 1] = vx + 0.5 * ux, vy + 0.5 * uy
        planes[i, 2], planes[i, 3] = nx, ny
