"""The strategy of a robot whose goals come from a real program."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from desim.ports import GridSpec, Params, Strategy, StrategyContext


class OutsideStrategy:
    """A strategy without goals of its own, by which the robot's map can be seen."""

    Params = Params

    def __init__(self) -> None:
        self._context: StrategyContext | None = None  # once there is a map
        self._is_news = False

    def choose(self, context: StrategyContext) -> None:
        """See ``Strategy.choose``: a program does."""

    def on_map(self, context: StrategyContext) -> None:
        """See ``FollowsMap``."""
        self._context, self._is_news = context, True

    def new_map(self) -> tuple[GridSpec, np.ndarray] | None:
        """The map as ``StrategyContext.occupancy`` has it, if it has changed since the last call.
        """
        if self._context is None or not self._is_news:
            return None
        self._is_news = False
        return self._context.grid, self._context.occupancy()

    def is_on_map(self, x_m: float, y_m: float) -> bool:
        """Whether there is a map, and a place is within its raster."""
        if self._context is None:
            return False
        x0_m, y0_m, x1_m, y1_m = self._context.grid.bounds()
        return x0_m <= x_m < x1_m and y0_m <= y_m < y1_m


class OutsideStrategies:
    """The newest strategy of each of ``robots`` that has started: ``of`` its name."""

    def __init__(self, robots: Collection[str]) -> None:
        self._robots = robots
        self.of: dict[str, OutsideStrategy] = {}

    def pilot(self, robot: str, own: Strategy) -> Strategy:
        """The strategy of a robot that starts; see ``Simulation``."""
        if robot not in self._robots:
            return own
        self.of[robot] = OutsideStrategy()
        return self.of[robot]
