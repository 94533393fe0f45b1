"""Patience: when a robot counts as stuck, and which recovery it tries next. Two kinds."""

from __future__ import annotations

import math
from enum import Enum, auto
from typing import Protocol

from desim.robot.navigation.recovery import Recovery
from desim.scenario.schema.navigation import Navigation, NavigationConstants
from desim.units import NS_PER_S

_PROGRESS_M = 0.2  # one cell of the map; maze_8: 192, 192 s
# Distance since the last new path that makes another one a new start; maze_8: 187, 198 s.
_MOVED_M = 0.3
_STANDS_NS = 10 * NS_PER_S  # twice ``stuck_after``: then recoveries go on from goal to goal


class GoalPatience(Protocol):
    """A rule by which a robot counts as stuck on its way to a goal, and chooses its recoveries.

    ``tried``: the number of recoveries since the goal began, or since one helped | ``insists``:
    whether the robot plans again if it finds no path or no clear velocity; otherwise a goal without
    a path is given up at once, and the robot stands in front of an obstacle
    """

    tried: int
    insists: bool

    def begin_goal(self, now_ns: int, stood_ns: int) -> None:
        """Note that a new goal has come, and for how long the robot has stood at its place."""

    def begin_path(self, now_ns: int, x_m: float, y_m: float) -> None:
        """Note that there is a new path, from this place."""

    def miss_path(self) -> None:
        """Note that there is no path to the goal."""

    def restart(self, now_ns: int) -> None:
        """Note that a recovery begins or ends."""

    def note(self, now_ns: int, x_m: float, y_m: float, togo_m: float, blocked: bool) -> bool:
        """Note where the robot is, with ``togo_m`` of the path to go; ``blocked``: no velocity is
        clear. Returns whether it is time for a recovery.
        """

    def is_over(self, now_ns: int) -> bool:
        """Whether it is time for a recovery, as ``note`` says it."""

    def next(self, wanted: Recovery | None = None) -> Recovery | None:
        """The next recovery, or ``wanted`` instead of it; None: the goal is given up."""


class ProgressPatience:
    """Patience that ends when the rest of the path has not become shorter for a while, whatever the
    reason."""

    insists = False
    _ORDER = (Recovery.REPLAN, Recovery.ROTATE, Recovery.RETREAT)

    def __init__(self, constants: NavigationConstants) -> None:
        self.tried = self._next = 0  # ``_next``: of the recoveries, whatever the goal
        self._constants = constants
        self._since_ns = 0
        self._least_m = math.inf
        self._place_m = (math.inf, math.inf)

    def begin_goal(self, now_ns: int, stood_ns: int) -> None:
        """Begin with the first recovery, unless the robot has stood for long: then what was tried
        for other goals did not help."""
        self.tried = 0
        if stood_ns < _STANDS_NS:
            self._next = 0

    def begin_path(self, now_ns: int, x_m: float, y_m: float) -> None:
        """Give the drive new time only if the robot has moved since the last new path."""
        self._least_m = math.inf
        if math.hypot(x_m - self._place_m[0], y_m - self._place_m[1]) > _MOVED_M:
            self._place_m = (x_m, y_m)
            self._since_ns = now_ns

    def miss_path(self) -> None:
        """Do nothing: a goal without a path is given up at once."""

    def restart(self, now_ns: int) -> None:
        self._least_m = math.inf
        self._since_ns = now_ns

    def note(self, now_ns: int, x_m: float, y_m: float, togo_m: float, blocked: bool) -> bool:
        if togo_m < self._least_m - _PROGRESS_M:
            if self._least_m < math.inf:
                self._since_ns = now_ns
            self._least_m = togo_m
        return now_ns - self._since_ns > self._constants.stuck_after_ns

    def is_over(self, now_ns: int) -> bool:
        return now_ns - self._since_ns > self._constants.stuck_after_ns

    def next(self, wanted: Recovery | None = None) -> Recovery | None:
        if self.tried >= self._constants.give_up_after:
            return None
        self.tried += 1
        self._next += 1
        return self._ORDER[(self._next - 1) % len(self._ORDER)] if wanted is None else wanted


class _Cause(Enum):
    PLANNING = auto()
    CONTROLLING = auto()
    OSCILLATION = auto()


class MoveBasePatience:
    """Patience that ends as in move_base (move_base.cpp, ``executeCycle``).

    It ends after ``planner_patience`` without a path, ``controller_patience`` without a clear
    velocity, or ``oscillation_timeout`` within ``oscillation_distance`` of one place. Once a
    recovery has helped, the next trouble begins with the first recovery again. As in move_base, a
    recovery gives planning and oscillation new time, but not the control: if the first velocity
    after it is blocked too, the next recovery follows at once.
    """

    insists = True
    _ORDER = (Recovery.CONSERVATIVE_RESET, Recovery.ROTATE, Recovery.AGGRESSIVE_RESET,
              Recovery.ROTATE)

    def __init__(self, constants: NavigationConstants) -> None:
        self.tried = 0
        self._constants = constants
        self._cause: _Cause | None = None  # of the last recovery
        self._pathless = self._blocked = False
        self._path_ns = self._clear_ns = self._moved_ns = 0
        self._place_m = (math.inf, math.inf)

    def begin_goal(self, now_ns: int, stood_ns: int) -> None:
        self.tried, self._cause, self._blocked = 0, None, False
        self._path_ns = self._clear_ns = self._moved_ns = now_ns

    def begin_path(self, now_ns: int, x_m: float, y_m: float) -> None:
        self._pathless, self._path_ns = False, now_ns
        self._helped(_Cause.PLANNING)

    def miss_path(self) -> None:
        self._pathless = True

    def restart(self, now_ns: int) -> None:
        self._path_ns = self._moved_ns = now_ns

    def note(self, now_ns: int, x_m: float, y_m: float, togo_m: float, blocked: bool) -> bool:
        self._blocked = blocked
        if math.hypot(x_m - self._place_m[0], y_m - self._place_m[1]) \
                >= self._constants.oscillation_distance_m:
            self._place_m, self._moved_ns = (x_m, y_m), now_ns
            self._helped(_Cause.OSCILLATION)
        if blocked:
            self._path_ns = now_ns
        else:
            self._clear_ns = now_ns
            self._helped(_Cause.CONTROLLING)
        return self.is_over(now_ns)

    def is_over(self, now_ns: int) -> bool:
        cause = self._what_is_over(now_ns)
        if cause is not None:
            self._cause = cause
        return cause is not None

    def next(self, wanted: Recovery | None = None) -> Recovery | None:
        if self.tried >= len(self._ORDER):
            return None
        self.tried += 1
        return self._ORDER[self.tried - 1] if wanted is None else wanted

    def _what_is_over(self, now_ns: int) -> _Cause | None:
        limits, timeout_ns = self._constants, self._constants.oscillation_timeout_ns
        if self._pathless:
            late = now_ns - self._path_ns > limits.planner_patience_ns
            return _Cause.PLANNING if late else None
        if self._blocked and now_ns - self._clear_ns > limits.controller_patience_ns:
            return _Cause.CONTROLLING
        if timeout_ns is not None and now_ns - self._moved_ns > timeout_ns:
            return _Cause.OSCILLATION
        return None

    def _helped(self, cause: _Cause) -> None:
        if self._cause is cause:
            self.tried = 0


def patience(navigation: Navigation) -> GoalPatience:
    """The kind that ``robot.navigation.recovery`` names."""
    kind = MoveBasePatience if navigation.recovery == "move_base" else ProgressPatience
    return kind(navigation.constants)
