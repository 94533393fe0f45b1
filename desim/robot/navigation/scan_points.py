"""The points of several lasers of a robot, as beams of one scan from the robot's middle."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from desim.middleware.contents import LaserScan
from desim.robot.stamped_poses import laser_at

PlacedScan = tuple[LaserScan, tuple[float, float, float]]  # x m, y m, yaw rad of the robot then


class Directions:
    """The directions of beams, of each kind of laser that a robot has."""

    def __init__(self) -> None:
        self._known: dict[tuple[float, float, int], tuple[np.ndarray, float]] = {}

    def of(self, scan: LaserScan) -> tuple[np.ndarray, float]:
        """[beams, 2] cos and sin of each beam's angle from the robot's heading, and the lower
        cosine of the two outermost ones."""
        key = scan.angle_min_rad, scan.angle_increment_rad, len(scan.ranges)
        known = self._known.get(key)
        if known is None:
            angles = scan.angle_min_rad + scan.angle_increment_rad * np.arange(key[2])
            beams = np.array([(math.cos(a), math.sin(a)) for a in angles])
            known = self._known[key] = beams, float(min(beams[0, 0], beams[-1, 0]))
        return known


def seen_from(scans: Sequence[PlacedScan], beams: Directions) -> tuple[np.ndarray, np.ndarray]:
    """[n] float32 m and [n, 2]: ranges and directions of all returns of ``scans``, as seen from the
    middle of the robot at the first one's instant, in its frame."""
    _, (x_m, y_m, yaw_rad) = scans[0]
    points = np.concatenate([_returns(scan, pose, beams) for scan, pose in scans]) - (x_m, y_m)
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    ahead, left = c * points[:, 0] + s * points[:, 1], c * points[:, 1] - s * points[:, 0]
    ranges = np.sqrt(ahead * ahead + left * left)
    away = ranges > 0.0
    return (ranges[away].astype(np.float32),
            np.column_stack([ahead[away], left[away]]) / ranges[away, None])


def _returns(scan: LaserScan, pose: tuple[float, float, float], beams: Directions) -> np.ndarray:
    """[n, 2] m, on the map, of the returns of a scan."""
    is_return = (scan.ranges > 0.0) & (scan.ranges < np.float32(scan.range_max_m))
    along = beams.of(scan)[0][is_return] * scan.ranges[is_return, None].astype(float)
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return np.column_stack([c * along[:, 0] - s * along[:, 1],
                            s * along[:, 0] + c * along[:, 1]]) + laser_at(*pose, scan)
