"""The time that a robot with goals has been at one place, whatever became of the goals."""

from __future__ import annotations

import math

from desim.units import NS_PER_S

PLACE_M = 0.5  # farther from where it began, a robot does not stand any more: its own width
GAP_NS = 5 * NS_PER_S  # between two goals, at most: exploration chooses one a second
LONG_NS = 20 * NS_PER_S  # who stands for so long says so: four times ``stuck_after``


class Standing:
    """A robot stands from an instant on, at a place that it did not leave by ``PLACE_M`` since.
    Time without a goal, of more than ``GAP_NS``, ends it."""

    def __init__(self) -> None:
        self._since_ns = self._last_ns = -1
        self._place_m = (math.inf, math.inf)

    def note(self, now_ns: int, x_m: float, y_m: float) -> int:
        """Note where the robot, which has a goal, is. Returns for how long (ns) it has stood."""
        moved_m = math.hypot(x_m - self._place_m[0], y_m - self._place_m[1])
        if moved_m > PLACE_M or now_ns - self._last_ns > GAP_NS:
            self._place_m, self._since_ns = (x_m, y_m), now_ns
        self._last_ns = now_ns
        return now_ns - self._since_ns
