"""Poses in the plane as arrays: x m, y m, yaw rad in the last axis."""

import numpy as np


def compose(base: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """The poses at ``motion`` from ``base``; either may be one pose or many ([..., 3])."""
    c, s = np.cos(base[..., 2]), np.sin(base[..., 2])
    x, y, turn = motion[..., 0], motion[..., 1], motion[..., 2]
    return np.stack((base[..., 0] + c * x - s * y, base[..., 1] + s * x + c * y,
                     base[..., 2] + turn), axis=-1)


def motion_between(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """The pose of ``after`` as seen from ``before``, its yaw in [-pi, pi)."""
    c, s = np.cos(before[..., 2]), np.sin(before[..., 2])
    dx, dy = after[..., 0] - before[..., 0], after[..., 1] - before[..., 1]
    return np.stack((c * dx + s * dy, c * dy - s * dx, wrapped(after[..., 2] - before[..., 2])),
                    axis=-1)


def wrapped(angle: np.ndarray) -> np.ndarray:
    """Angles in rad, each in [-pi, pi)."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi
