"""Loops that test a robot's footprint in the local costmap.

``cover`` [k, 3] are points of the footprint, its outline and a lattice inside: x, y in m, and by
how much the distance of a point from the outline is larger than the inscribed radius. A disc has
none. A polygon counts as a disc of its inscribed radius whose rim is as far from obstacles as the
polygon's outline is: so all formulas of the local planner hold for both.
"""

import math

import numpy as np

from desim.ports.kernels import cos, inner, sin, types
from desim.robot.navigation.kernels.local_costmap import FAR2, clearance2

_f8, _f4x2, _f8x2 = types.float64, types.float32[:, ::1], types.float64[:, ::1]


@inner(_f8(_f4x2, _f8, _f8x2, _f8, _f8, _f8))
def body_clearance2(near2, cell_m, cover, x, y, yaw):
    """The squared distance of the robot's centre from the nearest obstacle. Of a polygon: that of
    the centre of a disc of the inscribed radius whose rim is as far from obstacles as the polygon.
    Each point of ``cover`` is the centre of a disc inside of the polygon. The least distance of one
    of these discs from an obstacle is that of the polygon."""
    d2 = clearance2(near2, cell_m, x, y)
    if len(cover) == 0 or d2 >= FAR2:
        return d2
    low_m, c, s = math.sqrt(d2), cos(yaw), sin(yaw)
    for k in range(len(cover)):
        px = x + c * cover[k, 0] - s * cover[k, 1]
        py = y + s * cover[k, 0] + c * cover[k, 1]
        low_m = min(low_m, math.sqrt(clearance2(near2, cell_m, px, py)) - cover[k, 2])
    return max(low_m, 0.0)**2


@inner("b1(f4[:,::1], f8, f8[:,::1], f8, f8, f8, f8, f8, f8)")
def turn_is_clear(near2, cell_m, cover, x, y, yaw, by, step_rad, required2):
    """Whether the robot can turn on the spot by the angle ``by`` and stay the root of ``required2``
    away from obstacles, tested every ``step_rad``. A disc can."""
    if len(cover) == 0:
        return True
    steps = int(abs(by) / step_rad) + 1
    for k in range(1, steps + 1):
        if body_clearance2(near2, cell_m, cover, x, y, yaw + by * k / steps) < required2:
            return False
    return True


@inner("f8(f4[:,::1], f8, f8[:,::1], f8, f8, f8, f8, f8, f8, i8, i8, f8, f8)")
def least_clearance2(near2, cell_m, cover, x, y, yaw, v, w, rollout_s, steps, escapes, first2,
                     later2):
    """The least ``body_clearance2`` at ``steps`` poses on an arc. It is -1 if one of the first
    ``escapes`` poses is below ``first2``, or a later one below ``later2``."""
    step_m, turn, low2 = v * rollout_s / steps, w * rollout_s / steps, np.inf
    for k in range(steps):
        heading = yaw + (k + 0.5) * turn
        x, y = x + step_m * cos(heading), y + step_m * sin(heading)
        d2 = body_clearance2(near2, cell_m, cover, x, y, yaw + (k + 1) * turn)
        if d2 < (first2 if k < escapes else later2):
            return -1.0
        low2 = min(low2, d2)
    return low2
