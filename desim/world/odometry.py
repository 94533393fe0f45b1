"""Wheel odometry, in two named models.

``independent``: each reading is the true pose plus fresh noise (MORSE's pose noise). Reading k is a
pure function of the pose and k.

``random_walk``: dead reckoning. At every odometry tick the motion since the last one, seen from the
robot, gets noise of the same standard deviations and is added to the odometer's pose. The fleet's
odometers advance together at each of their ticks, read or not, with the pose of the last world
tick; noise number k belongs to tick k. A snapshot holds their poses, so that readings are pure
functions of snapshots and reading late changes nothing. An odometer that is faster than the base
tick makes the ticks between two base ticks at once.
"""

from fractions import Fraction

import numpy as np

from desim.scenario.schema.robot import Odometry
from desim.units import NS_PER_S
from desim.world.kernels import odometry as kernels


class Odometers:
    """The odometers of a fleet; ``poses`` [n, 3] at time 0, ``keys`` [n] uint64 of their noise."""

    def __init__(self, odometry: Odometry, poses: np.ndarray, keys: np.ndarray) -> None:
        self._rate_hz: Fraction = odometry.rate_hz
        self._noise = (odometry.position_noise_m, odometry.heading_noise_rad)
        self._keys = keys
        self._each_key = list(keys)
        self._tick = 1  # reading 0 is the start, exactly
        self.walks = odometry.model == "random_walk"
        self._seen = poses.copy()
        self.reckoned = poses.copy() if self.walks else None

    def advance(self, before_ns: int, poses: np.ndarray) -> None:
        """Take in all odometry ticks before ``before_ns`` (of the next world tick), which see
        ``poses``. ``reckoned`` is a new array afterwards."""
        reckoned = self.reckoned
        if reckoned is None:
            return
        while self._tick * NS_PER_S // self._rate_hz < before_ns:
            reckoned = reckoned.copy()
            kernels.reckon(poses, self._keys, self._tick, *self._noise, self._seen, reckoned)
            self._tick += 1
        self.reckoned = reckoned

    def read(self, poses: np.ndarray, reckoned: np.ndarray | None, robot: int,
             tick: int) -> np.ndarray:
        """[3] reading number ``tick`` of ``robot``, from a snapshot's poses."""
        if reckoned is not None:
            return reckoned[robot].copy()
        out = np.empty(3)
        kernels.noisy_pose(poses, robot, self._each_key[robot], tick, *self._noise, out)
        return out
