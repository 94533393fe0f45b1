"""The local layer: what the laser sees around the robot, or saw a moment ago."""

from __future__ import annotations

import math

import numpy as np

from desim.middleware.messages import LaserScan
from desim.robot.navigation.global_costmap import Costmap
from desim.robot.navigation.kernels import local_costmap as kernels
from desim.units import seconds

_MOST_REMEMBERED = 500  # points
_YIELD_M = 1.2  # what is farther away is not yielded to


class Sight:
    """A window of ``size_m`` around the robot, as of its last look.

    ``near2`` [n, n] float32 squared distances in m^2 to what was seen, exact up to ``reach_m`` |
    ``seen_from`` [3] pose on the map, the window's frame | ``yield_m`` distance to what moves,
    perhaps, and has the right of way | ``flat``, ``frame`` the global costmap.
    """

    __slots__ = ("near2", "seen_from", "yield_m", "flat", "frame", "_cell_m", "_reach_m", "_beams",
                 "_memory", "_remembered")

    def __init__(self, size_m: float, cell_m: float, reach_m: float) -> None:
        cells = round(size_m / cell_m)
        self.near2 = np.full((cells, cells), kernels.FAR2, np.float32)
        self.seen_from = np.zeros(3)
        self.yield_m = _YIELD_M
        self.flat = np.zeros(0, np.uint8)
        self.frame = np.zeros(1, kernels.FRAME)
        self._cell_m, self._reach_m = cell_m, reach_m
        self._beams = np.zeros((0, 2))
        self._memory = np.zeros((_MOST_REMEMBERED, 3))
        self._remembered = 0

    def use(self, costmap: Costmap) -> None:
        """What is known of the place at large; live."""
        spec = costmap.spec
        self.flat = costmap.flat
        self.frame[0] = spec.x_m, spec.y_m, spec.resolution_m, spec.width + 2, spec.height + 2

    def look(self, scan: LaserScan, x_m: float, y_m: float, yaw_rad: float) -> None:
        """Take ``scan``, seen from this pose, as what stands around the robot."""
        if len(self._beams) != len(scan.ranges):
            angles = scan.angle_min_rad + scan.angle_increment_rad * np.arange(len(scan.ranges))
            self._beams = np.array([(math.cos(a), math.sin(a)) for a in angles])
        here = self.seen_from
        here[0], here[1], here[2] = x_m, y_m, yaw_rad
        # float32, as the ranges are: no return must not turn into a hit by rounding.
        self._remembered, self.yield_m = kernels.look(
            scan.ranges, self._beams, float(np.float32(scan.range_max_m)), seconds(scan.stamp_ns),
            self._cell_m, self._reach_m, _YIELD_M, here, self.flat, self.frame,
            self._memory, self._remembered, self.near2)
