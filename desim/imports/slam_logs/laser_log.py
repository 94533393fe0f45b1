"""A log for SLAM: the odometry and laser scans of a robot."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from desim.ports.localization import LaserGeometry


class LaserLog(NamedTuple):
    """A log: ``times_s`` [scans], ``odometry`` [scans, 3] of the laser (x m, y m, yaw rad),
    ``ranges`` [scans, beams] in m, and the laser's geometry. ``warnings``: all that is implausible,
    with file and place."""

    times_s: np.ndarray
    odometry: np.ndarray
    ranges: np.ndarray
    laser: LaserGeometry
    warnings: tuple[str, ...] = ()

    def first(self, scans: int) -> LaserLog:
        """The log of its first scans."""
        return self._replace(times_s=self.times_s[:scans], odometry=self.odometry[:scans],
                             ranges=self.ranges[:scans])
