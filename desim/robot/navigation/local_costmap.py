"""The local costmap: distances to what the laser sees around the robot, or saw a moment ago."""

from __future__ import annotations

import math

import numpy as np

from desim.middleware.contents import LaserScan
from desim.robot.navigation.global_costmap import GlobalCostmap
from desim.robot.navigation.kernels import local_costmap as kernels
from desim.units import seconds

_MOST_REMEMBERED = 500  # points, more than ever are; maze_8: same
# Greatest distance of an obstacle to yield to; maze_8: 201 s, same. (Beyond 1.02 m the robot may go
# at full speed anyway, by ``_YIELD_S``.)
_YIELD_M = 1.2


class LocalCostmap:
    """A window of ``size_m`` around the robot, as of the last scan; ``around`` is the costmap of
    the whole map.

    ``near2`` [n, n] float32 squared distances in m^2 to the points seen, exact up to ``reach_m`` |
    ``scan``, ``layer`` one record each of the kernels' ``SCAN`` and ``LAYER``
    """

    def __init__(self, size_m: float, cell_m: float, reach_m: float,
                 around: GlobalCostmap) -> None:
        cells = round(size_m / cell_m)
        self.near2 = np.full((cells, cells), kernels.FAR2, np.float32)
        self.scan = np.zeros(1, kernels.SCAN)
        self.layer = np.zeros(1, kernels.LAYER)
        self.layer[0] = (cell_m, reach_m, _YIELD_M, _YIELD_M, 0)
        self.around = around
        self._beams = np.zeros((0, 2))
        self._memory = np.zeros((_MOST_REMEMBERED, 3))

    def observe(self, scan: LaserScan, x_m: float, y_m: float, yaw_rad: float) -> None:
        """Replace the window by what ``scan`` sees from this pose."""
        if len(self._beams) != len(scan.ranges):
            angles = scan.angle_min_rad + scan.angle_increment_rad * np.arange(len(scan.ranges))
            self._beams = np.array([(math.cos(a), math.sin(a)) for a in angles])
        # float32, as the ranges are: no return must not turn into a hit by rounding.
        self.scan[0] = (x_m, y_m, yaw_rad, seconds(scan.stamp_ns),
                        float(np.float32(scan.range_max_m)))
        kernels.observe(scan.ranges, self._beams, self.scan, self.layer, self.around.flat,
                        self.around.frame, self._memory, self.near2)
