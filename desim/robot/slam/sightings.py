"""Teammates that a laser sees: where the middles of their bodies are."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from desim.ports.localization import LaserGeometry
from desim.robot.slam.kernels.points import STEP_M, Beams, without_bodies
from desim.robot.transforms import turned

# Of bodies, which are taken for discs, and of what they do between two nodes (ours: in the loop the
# root mean square is 0.01 m; beams to both sides of a body leave its middle open by their spacing).
_SIGMA_M = 0.02
_SPACINGS = 1.0 / math.sqrt(12.0)


class Sighting(NamedTuple):
    """A body at ``x_m``, ``y_m`` as seen from the robot; its place is known to ``along_m`` on the
    line of sight and to ``across_m`` aside (standard deviations)."""

    x_m: float
    y_m: float
    along_m: float
    across_m: float

    @property
    def information(self) -> np.ndarray:
        """[3, 3] on the place, along the robot's axes; nothing is known of the heading."""
        known = np.diag((self.along_m ** -2, self.across_m ** -2, 0.0))
        return turned(known, math.atan2(self.y_m, self.x_m))


def sightings(ranges: np.ndarray, laser: LaserGeometry, width_m: float) -> list[Sighting]:
    """The bodies in a scan (``ranges`` [beams] m) that are at most ``width_m`` wide, and that
    nothing hides in part: beams to both sides pass them."""
    if not width_m:
        return []
    ranges = np.ascontiguousarray(ranges, float)
    beyond = np.empty(len(ranges))
    without_bodies(ranges, Beams(laser.angle_min_rad, laser.increment_rad, laser.shortest_m,
                                 laser.longest_m, *laser.mount), width_m, beyond)
    gone = np.flatnonzero(np.isinf(beyond) & (ranges >= laser.shortest_m)
                          & (ranges < laser.longest_m))
    ends = np.flatnonzero((np.diff(gone) > 1) | (np.abs(np.diff(ranges[gone])) > STEP_M)) + 1
    return [_body(ranges[beams], beams, laser, 0.5 * width_m)
            for beams in np.split(gone, ends) if len(beams) and _is_whole(ranges, beams)]


def _is_whole(ranges: np.ndarray, beams: np.ndarray) -> bool:
    """Whether the beams [beams] to both sides of these ones [n] go on behind them."""
    first, last = beams[0], beams[-1]
    return bool(first > 0 and last + 1 < len(ranges)
                and ranges[first - 1] > ranges[first] and ranges[last + 1] > ranges[last])


def _body(ranges: np.ndarray, beams: np.ndarray, laser: LaserGeometry, radius_m: float) -> Sighting:
    """The disc that these ``beams`` [n] have met."""
    angles = laser.angle_min_rad + beams * laser.increment_rad
    middle = 0.5 * (angles[0] + angles[-1])
    aside = ranges * np.sin(angles - middle)
    depth_m = np.sqrt(np.maximum(radius_m ** 2 - aside ** 2, 0.0))
    away_m = float((ranges * np.cos(angles - middle) + depth_m).mean())
    x_m, y_m, yaw_rad = laser.mount
    return Sighting(x_m + away_m * math.cos(yaw_rad + middle),
                    y_m + away_m * math.sin(yaw_rad + middle), _SIGMA_M,
                    _SIGMA_M + _SPACINGS * away_m * abs(laser.increment_rad))
