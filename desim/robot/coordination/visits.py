"""Repeated visits of a robot to one place: after a few, another one would find nothing new."""

from __future__ import annotations

import math

# Visits after which a remaining frontier counts as unresolvable; maze_8 with 1: 197 s, 3: 202 s.
_VISITS = 2


class Visits:
    """The number of times in a row that the robot has come to one place."""

    def __init__(self, tolerance_m: float) -> None:
        self._tolerance_m = tolerance_m
        self._x_m = self._y_m = math.inf
        self._count = 0

    def add(self, x_m: float, y_m: float) -> None:
        """Note that the robot has reached its goal, this place."""
        self._count = self._count + 1 if self._is_near(x_m, y_m) else 1
        self._x_m, self._y_m = x_m, y_m

    def were_fruitless(self, x_m: float, y_m: float) -> bool:
        """Whether more visits to this place would find nothing new."""
        return self._count >= _VISITS and self._is_near(x_m, y_m)

    def _is_near(self, x_m: float, y_m: float) -> bool:
        return math.hypot(x_m - self._x_m, y_m - self._y_m) <= self._tolerance_m
