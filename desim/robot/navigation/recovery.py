"""Recoveries: the behaviours that a robot tries when it is stuck."""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np

from desim.robot.navigation.global_costmap import GlobalCostmap

# Range of the distance to back off: drawn, so that two robots that block each other differ;
# maze_8: same.
_RETREAT_M = (0.5, 1.5)
_DIRECTIONS = 8  # to back off to, 45 degrees apart; maze_8: same
_GENTLE = 0.6  # share of the full deceleration that ends a turn; maze_8: 177, 188 s


class Recovery(IntEnum):
    """The behaviours, of which ``patience.py`` chooses one. The resets are move_base's
    clear_costmap_recovery."""

    REPLAN = 0
    ROTATE = 1
    RETREAT = 2
    CONSERVATIVE_RESET = 3
    AGGRESSIVE_RESET = 4


class Spin:
    """A full turn on the spot, to see what is around (move_base's rotate_recovery). ``left_rad`` of
    it is still to come."""

    def __init__(self, turn_radps: float, acceleration_radps2: float, yaw_rad: float,
                 now_ns: int) -> None:
        self._fastest_radps = turn_radps
        self._acceleration_radps2 = acceleration_radps2
        self._yaw_rad = yaw_rad
        self.left_rad = 2.0 * math.pi
        # Twice the time of an unhindered turn, plus a second: something holds the robot then.
        self._end_ns = now_ns + round(1e9 * (1.0 + 4.0 * math.sqrt(
            self.left_rad / acceleration_radps2) + 2.0 * self.left_rad / turn_radps))

    def turn_radps(self, yaw_rad: float, now_ns: int) -> float | None:
        """The next turn rate, None when done: w^2 = 2 a left, as in rotate_recovery, with less than
        the full deceleration, as a command takes a control period to take effect."""
        turned_rad = math.remainder(yaw_rad - self._yaw_rad, 2.0 * math.pi)
        self._yaw_rad = yaw_rad
        self.left_rad -= turned_rad
        if self.left_rad < 0.1 or now_ns > self._end_ns:
            return None
        return min(self._fastest_radps,
                   math.sqrt(2.0 * _GENTLE * self._acceleration_radps2 * self.left_rad))


def retreat(costmap: GlobalCostmap, x_m: float, y_m: float, yaw_rad: float,
            rng: np.random.Generator) -> np.ndarray | None:
    """A short path [2, 2] back, or aside, over known free cells; None where there is none."""
    length_m = float(rng.uniform(*_RETREAT_M))
    first = yaw_rad + math.pi + float(rng.uniform(-0.5, 0.5)) * math.pi
    for k in range(_DIRECTIONS):
        aside = (k + 1) // 2 * (1 if k % 2 else -1)
        heading_rad = first + aside * 2.0 * math.pi / _DIRECTIONS
        end_m = (x_m + length_m * math.cos(heading_rad), y_m + length_m * math.sin(heading_rad))
        start = costmap.free_near(x_m, y_m, 1.0)
        if start >= 0 and costmap.clear_line(costmap.centre(start), end_m):
            return np.array([(x_m, y_m), end_m])
    return None
