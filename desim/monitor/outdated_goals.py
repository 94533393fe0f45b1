"""Wasted drives: towards places that a teammate has explored, because its map comes late."""

from __future__ import annotations

import math

import numpy as np

from desim.compiler.kernel import compiled_function
from desim.monitor import kernels
from desim.monitor.coverage import Coverage
from desim.ports import GridSpec
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import cell_numbers
from desim.units import NS_PER_S

_known_elsewhere = compiled_function(kernels.known_elsewhere)

NEAR_M = 1.0  # from a goal: the cells for whose sake a robot drives there
MOVING_M = 0.05  # a robot that came farther than this within the last second is moving


class OutdatedGoals:
    """The time and the distance that each robot drives towards an outdated goal.

    A goal is outdated while there are cells of G within ``NEAR_M`` of it that the robot does not
    know, and some robot has known each of them. Sampled once a second: a second counts for a robot
    that was moving in it if its goal is outdated at the end. ``coverage`` is the fleet's.
    """

    def __init__(self, grid: GridSpec, coverage: Coverage, robots: int) -> None:
        self._grid, self._numbers, self._coverage = grid, cell_numbers(grid), coverage
        self._cells: list[np.ndarray | None] = [None] * robots  # near each robot's goal
        self._before_ns = 0
        self._before_m = np.zeros(robots)
        self.time_ns = [0] * robots
        self.way_m = [0.0] * robots

    def sets_out(self, robot: int, x_m: float, y_m: float) -> None:
        """Note that a robot has a goal from now on."""
        grid = self._grid
        column, row = grid.cell(x_m, y_m)
        reach = int(NEAR_M / grid.resolution_m)
        columns = np.arange(max(column - reach, 0), min(column + reach + 1, grid.width))
        rows = np.arange(max(row - reach, 0), min(row + reach + 1, grid.height))
        near = np.hypot(rows[:, None] - row, columns - column) * grid.resolution_m <= NEAR_M
        numbers = self._numbers[grid.width + rows][:, None] + self._numbers[columns]
        self._cells[robot] = numbers[near].astype(np.int64)

    def ends(self, robot: int) -> None:
        """Note that a robot has no goal any more."""
        self._cells[robot] = None

    def each_second(self, now_ns: int, travelled_m: np.ndarray, maps: list[RobotMap | None]
                    ) -> None:
        """Sample once a second: [robots] m driven so far, and their maps."""
        moved_m = travelled_m - self._before_m
        for robot in np.flatnonzero(moved_m > MOVING_M).tolist():
            cells, robot_map = self._cells[robot], maps[robot]
            if cells is not None and robot_map is not None and _known_elsewhere(
                    robot_map.fused, *self._coverage.known_to_some, cells):
                self.time_ns[robot] += now_ns - self._before_ns
                self.way_m[robot] += float(moved_m[robot])
        self._before_ns, self._before_m = now_ns, travelled_m

    def of(self, robot: int) -> dict[str, float]:
        """Seconds and metres of one robot."""
        return {"outdated_goal_s": self.time_ns[robot] / NS_PER_S,
                "outdated_goal_m": self.way_m[robot]}

    def summary(self) -> dict[str, float]:
        """Seconds and metres of all robots."""
        return {"outdated_goal_s": sum(self.time_ns) / NS_PER_S,
                "outdated_goal_m": math.fsum(self.way_m)}
