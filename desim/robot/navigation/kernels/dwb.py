"""Loops of the local planner ``dwb``: each sampled velocity is simulated and rated by critics.

``near2`` is the local costmap. Poses and the path are in its frame; a *cell* is a column and a row
of it. ``setup`` is one record. Names of critics are those of dwb_critics (Nav2).
"""

import math

import numpy as np

from desim.ports.kernels import cos, exp, from_dtype, inner, lean, sin, types
from desim.robot.navigation.kernels.local_costmap import clearance2

SETUP = np.dtype([(name, "f8") for name in (
    "x_m", "y_m", "yaw_rad", "speed_mps", "turn_radps",  # the present pose and velocity
    "acceleration_mps2", "turn_acceleration_radps2", "rollout_s", "step_m", "step_rad",
    "cell_m", "inscribed_m", "inflation_m", "inflation_scaling", "forward_m",
    "goal_yaw_rad", "slowing_factor")]
    # RotateToGoal: near the goal, and standing there. Oscillation: signs that are not allowed.
    + [(name, "b1") for name in ("in_window", "rotating", "no_forward", "no_backward", "no_left",
                                 "no_right")]
    + [(name, "i8") for name in ("goal_column", "goal_row", "align_column", "align_row")])
_FAR = 2**60  # cells squared

CRITICS = ("RotateToGoal", "BaseObstacle", "GoalAlign", "PathAlign", "PathDist", "GoalDist")

_setup = types.Array(from_dtype(SETUP), 1, "C")
_f8, _f4x2, _f8x2 = types.float64, types.float32[:, ::1], types.float64[:, ::1]
_i8x2 = types.int64[:, ::1]


@inner("UniTuple(i8, 2)(f8, f8, f8, i8)")
def cell_of(x, y, cell_m, size):
    """The column and row of a point; it is outside of the layer unless both are below ``size`` and
    not negative."""
    return (int(np.floor(x / cell_m + 0.5 * size)), int(np.floor(y / cell_m + 0.5 * size)))


@inner("f8(f4[:,::1], f8, f8, f8, f8, f8, f8)")
def base_obstacle(near2, cell_m, inscribed_m, inflation_m, scaling, x, y):
    """costmap_2d's cost of the cell of a point; -1 within the inscribed radius of an obstacle."""
    distance = math.sqrt(clearance2(near2, cell_m, x, y))
    if distance <= inscribed_m:
        return -1.0
    if distance > inflation_m:
        return 0.0
    return np.floor(252.0 * exp(-scaling * (distance - inscribed_m)))


@inner("f8(i8[:,::1], i8, i8)")
def path_distance(cells, column, row):
    """The Manhattan distance in cells to the nearest of the path's ``cells`` [n, 2]; the nearest by
    Euclid is taken, as CostmapQueue does, of equally near ones the first."""
    best, found = _FAR, 0
    for k in range(len(cells)):
        dx, dy = cells[k, 0] - column, cells[k, 1] - row
        if dx * dx + dy * dy < best:
            best, found = dx * dx + dy * dy, abs(dx) + abs(dy)
    return float(found)


@inner("f8(f8, f8, f8, f8)")
def nearer(now, wanted, rate, dt):
    """The velocity after ``dt`` with this acceleration (projectVelocity)."""
    if now < wanted:
        return min(wanted, now + rate * dt)
    return max(wanted, now - rate * dt)


@inner(types.boolean(_setup, _f8, _f8))
def allowed(setup, v, w):
    """Whether Oscillation and RotateToGoal let this velocity pass."""
    s = setup[0]
    if (s.no_forward and v > 0.0) or (s.no_backward and v < 0.0):
        return False
    if (s.no_left and w > 0.0) or (s.no_right and w < 0.0):
        return False
    if s.in_window and s.rotating:
        return v == 0.0
    return not s.in_window or v * v < s.speed_mps**2


@inner(types.boolean(_f4x2, _setup, _i8x2, _f8, _f8, types.float64[::1]))
def rate(near2, setup, cells, v, w, scores):
    """Write the raw score of each of ``CRITICS`` for this velocity; False if it is not legal."""
    s, size = setup[0], np.int64(len(near2))
    if not allowed(setup, v, w):
        return False
    steps = max(int(np.ceil(max(abs(v) * s.rollout_s / s.step_m,
                                abs(w) * s.rollout_s / s.step_rad))), 1)
    dt, x, y, yaw, speed, turn = s.rollout_s / steps, s.x_m, s.y_m, s.yaw_rad, s.speed_mps, \
        s.turn_radps
    cost = base_obstacle(near2, s.cell_m, s.inscribed_m, s.inflation_m, s.inflation_scaling, x, y)
    for _ in range(steps):
        if cost < 0.0:
            return False
        speed = nearer(speed, v, s.acceleration_mps2, dt)
        turn = nearer(turn, w, s.turn_acceleration_radps2, dt)
        x, y, yaw = x + speed * cos(yaw) * dt, y + speed * sin(yaw) * dt, yaw + turn * dt
        column, row = cell_of(x, y, s.cell_m, size)
        if not (0 <= column < size and 0 <= row < size):
            return False
        cost = base_obstacle(near2, s.cell_m, s.inscribed_m, s.inflation_m, s.inflation_scaling,
                             x, y)
    column, row = cell_of(x, y, s.cell_m, size)
    ahead_column, ahead_row = cell_of(x + s.forward_m * cos(yaw), y + s.forward_m * sin(yaw),
                                      s.cell_m, size)
    if cost < 0.0 or not (0 <= ahead_column < size and 0 <= ahead_row < size):
        return False
    scores[0] = 0.0
    if s.in_window:
        off = s.goal_yaw_rad - yaw
        off -= 2.0 * math.pi * np.floor(off / (2.0 * math.pi) + 0.5)
        scores[0] = abs(off) + (0.0 if s.rotating else v * v * s.slowing_factor)
    scores[1] = cost
    scores[2] = abs(s.align_column - ahead_column) + abs(s.align_row - ahead_row)
    scores[3] = path_distance(cells, ahead_column, ahead_row)
    scores[4] = path_distance(cells, column, row)
    scores[5] = abs(s.goal_column - column) + abs(s.goal_row - row)
    return True


@lean(types.void(_f4x2, _setup, _i8x2, _f8x2, types.float64[::1], _f8x2, types.float64[::1]))
def rate_all(near2, setup, cells, velocities, scales, scores, totals):
    """Rate ``velocities`` [n, 2]. Out: ``scores`` [n, 6], raw, and ``totals`` [n], the sums of
    scores times ``scales``; infinite where a velocity is not legal."""
    for i in range(len(velocities)):
        totals[i] = np.inf
        if rate(near2, setup, cells, velocities[i, 0], velocities[i, 1], scores[i]):
            totals[i] = 0.0
            for k in range(len(scales)):
                totals[i] += scores[i, k] * scales[k]
