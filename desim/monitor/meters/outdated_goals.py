"""Wasted drives: towards places that a teammate has explored, because its map comes late."""

from __future__ import annotations

import math

import numpy as np

from desim.compiler.kernel import compiled_function
from desim.engine.trace import real
from desim.monitor import kernels
from desim.monitor.coverage import Coverage
from desim.monitor.meters.meter import Meter, Second
from desim.monitor.meters.motion import MOVING_M
from desim.monitor.samples import Sample
from desim.ports import GridSpec
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import cell_numbers
from desim.units import NS_PER_S

_known_elsewhere = compiled_function(kernels.known_elsewhere)

NEAR_M = 1.0  # from a goal: the cells for whose sake a robot drives there


class OutdatedGoals(Meter):
    """The time and the distance that each robot drives towards an outdated goal.

    A goal is outdated while there are cells of G within ``NEAR_M`` of it that the robot does not
    know, and some robot has known each of them. Sampled once a second: a second counts for a robot
    that was moving in it if its goal is outdated at the end. ``coverage`` is the fleet's.
    """

    def __init__(self, grid: GridSpec, coverage: Coverage, robots: tuple[str, ...],
                 explorers: tuple[str, ...]) -> None:
        self._grid, self._numbers, self._coverage = grid, cell_numbers(grid), coverage
        self._robots, self._explorers = robots, explorers
        self._own = [robots.index(name) for name in explorers]
        self._cells: dict[str, np.ndarray] = {}  # near each robot's goal
        self._maps: dict[str, RobotMap | None] = {}
        self._before_ns = 0
        self._before_m = np.zeros(len(explorers))
        self._time_ns = [0] * len(explorers)
        self._way_m = [0.0] * len(explorers)
        self.listeners = {"goal": self._sets_out, "goal_reached": self._ends,
                          "goal_aborted": self._ends}

    def watch(self, robot: str, robot_map: RobotMap | None, now_ns: int) -> None:
        self._maps[robot] = robot_map
        self._ends(robot)

    def _sets_out(self, robot: str, x_bits: int, y_bits: int, _: int) -> None:
        grid = self._grid
        column, row = grid.cell(real(x_bits), real(y_bits))
        reach = int(NEAR_M / grid.resolution_m)
        columns = np.arange(max(column - reach, 0), min(column + reach + 1, grid.width))
        rows = np.arange(max(row - reach, 0), min(row + reach + 1, grid.height))
        near = np.hypot(rows[:, None] - row, columns - column) * grid.resolution_m <= NEAR_M
        numbers = self._numbers[grid.width + rows][:, None] + self._numbers[columns]
        self._cells[robot] = numbers[near].astype(np.int64)

    def _ends(self, robot: str, *_: int) -> None:
        self._cells.pop(robot, None)

    def each_second(self, second: Second) -> None:
        travelled_m = second.travelled_m[self._own]
        moved_m = travelled_m - self._before_m
        inside, union = self._coverage.known_to_some
        for i in np.flatnonzero(moved_m > MOVING_M).tolist():
            robot = self._explorers[i]
            cells, robot_map = self._cells.get(robot), self._maps.get(robot)
            if cells is not None and robot_map is not None and _known_elsewhere(
                    robot_map.fused, inside, union, cells):
                self._time_ns[i] += second.now_ns - self._before_ns
                self._way_m[i] += float(moved_m[i])
        self._before_ns, self._before_m = second.now_ns, travelled_m

    def by_host(self, now_ns: int) -> dict[str, Sample]:
        """Seconds and metres of each robot; None without software."""
        return {**dict.fromkeys(self._robots, _of(None, None)), **{
            name: _of(time_ns / NS_PER_S, way_m) for name, time_ns, way_m
            in zip(self._explorers, self._time_ns, self._way_m, strict=True)}}

    def summary(self, now_ns: int) -> Sample:
        """Seconds and metres of all robots."""
        return _of(sum(self._time_ns) / NS_PER_S, math.fsum(self._way_m))


def _of(time_s: float | None, way_m: float | None) -> Sample:
    return {"outdated_goal_s": time_s, "outdated_goal_m": way_m}
