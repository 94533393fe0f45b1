"""The geometry of poses."""

import math

from desim.middleware.contents import Pose


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
