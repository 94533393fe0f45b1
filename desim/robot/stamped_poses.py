"""Stamped poses: the step from one to another, interpolation, and the place of a laser."""

import math

from desim.middleware.contents import LaserScan, Pose


def step(before: Pose, after: Pose) -> tuple[float, float]:
    """The distance (m) and the turn (rad, not negative) from pose to pose."""
    return (math.hypot(after.x_m - before.x_m, after.y_m - before.y_m),
            abs(math.remainder(after.yaw_rad - before.yaw_rad, math.tau)))


def between(before: Pose, after: Pose, stamp_ns: int) -> Pose:
    """The pose at an instant between two poses, in proportion to time."""
    part = (stamp_ns - before.stamp_ns) / (after.stamp_ns - before.stamp_ns)
    return Pose(stamp_ns, before.x_m + part * (after.x_m - before.x_m),
                before.y_m + part * (after.y_m - before.y_m),
                before.yaw_rad + part * math.remainder(after.yaw_rad - before.yaw_rad, math.tau))


def laser_at(x_m: float, y_m: float, yaw_rad: float, scan: LaserScan) -> tuple[float, float]:
    """The place (m) of the laser of ``scan`` on a robot with this pose."""
    if scan.x_m == scan.y_m == 0.0:
        return x_m, y_m
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return x_m + c * scan.x_m - s * scan.y_m, y_m + s * scan.x_m + c * scan.y_m
