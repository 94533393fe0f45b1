"""Readings of wheel odometers: true poses with counter-based noise."""

import numpy as np

from desim.ports.kernels import cos, lean, normal, sin, types

_FIXED = types.Array(types.float64, 2, "C", readonly=True)  # accepts writable arrays too


@lean(types.void(_FIXED, types.int64, types.uint64, types.int64, types.float64, types.float64,
                 types.Array(types.float64, 1, "C")))
def noisy_pose(poses, robot, key, tick, position_m, heading_rad, out):
    """An odometry reading with noise that is independent of earlier ones (MORSE's PoseNoise).

    poses [robots, 3] | out [3] = pose + normal numbers 3 tick .. 3 tick + 2 of ``key``, scaled
    """
    first = np.uint64(3) * np.uint64(tick)
    out[0] = poses[robot, 0] + position_m * normal(key, first)
    out[1] = poses[robot, 1] + position_m * normal(key, first + np.uint64(1))
    out[2] = poses[robot, 2] + heading_rad * normal(key, first + np.uint64(2))


@lean(types.void(_FIXED, types.Array(types.uint64, 1, "C"), types.int64, types.float64,
                 types.float64, types.Array(types.float64, 2, "C"),
                 types.Array(types.float64, 2, "C")))
def reckon(poses, keys, tick, position_m, heading_rad, seen, reckoned):
    """Add one odometry tick of dead reckoning: the motion since the last tick, seen from the robot,
    with noise on it, is added to the odometer's pose.

    poses [robots, 3] true | seen [robots, 3] true at the last tick, updated |
    reckoned [robots, 3] updated
    """
    first = np.uint64(3) * np.uint64(tick)
    for r in range(poses.shape[0]):
        c, s = cos(seen[r, 2]), sin(seen[r, 2])
        x, y = poses[r, 0] - seen[r, 0], poses[r, 1] - seen[r, 1]
        forward = c * x + s * y + position_m * normal(keys[r], first)
        left = c * y - s * x + position_m * normal(keys[r], first + np.uint64(1))
        c, s = cos(reckoned[r, 2]), sin(reckoned[r, 2])
        reckoned[r, 0] += c * forward - s * left
        reckoned[r, 1] += s * forward + c * left
        reckoned[r, 2] += (poses[r, 2] - seen[r, 2]
                           + heading_rad * normal(keys[r], first + np.uint64(2)))
        for i in range(3):
            seen[r, i] = poses[r, i]
