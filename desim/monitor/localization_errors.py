"""Errors of the poses that robots found by SLAM, against the truth."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from desim.engine.trace import real


class LocalizationErrors:
    """Sums over processed scans. ``true_poses()`` [robots, 3] as of now."""

    def __init__(self, robots: tuple[str, ...], true_poses: Callable[[], np.ndarray]) -> None:
        self._index = {name: i for i, name in enumerate(robots)}
        self._true_poses = true_poses
        self._count = 0
        self._square_m2 = self._square_rad2 = self._most_m = 0.0

    def localized(self, robot: str, x: int, y: int, yaw: int) -> None:
        """A robot has placed the scan of this instant; the bits of x m, y m and yaw rad."""
        x_m, y_m, yaw_rad = self._true_poses()[self._index[robot]].tolist()
        off_m = math.hypot(real(x) - x_m, real(y) - y_m)
        self._count += 1
        self._square_m2 += off_m * off_m
        self._square_rad2 += math.remainder(real(yaw) - yaw_rad, math.tau)**2
        self._most_m = max(self._most_m, off_m)

    def summary(self) -> dict[str, float | None]:
        """``ate_m``: absolute trajectory error, the root of the mean square (Sturm et al. 2012,
        without alignment: the start is known); ``ate_max_m``; ``heading_rms_rad``. None without
        SLAM."""
        if not self._count:
            return {"ate_m": None, "ate_max_m": None, "heading_rms_rad": None}
        return {"ate_m": math.sqrt(self._square_m2 / self._count), "ate_max_m": self._most_m,
                "heading_rms_rad": math.sqrt(self._square_rad2 / self._count)}
