"""Duplicated exploration: terrain that several robots have seen, where one would have done."""

from __future__ import annotations

import numpy as np

from desim.monitor.meters.meter import Meter
from desim.monitor.samples import Sample
from desim.ports import GridSpec
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import CELLS, FREE, OCCUPIED, tiles_of


class Overlap(Meter):
    """The cells of ``reachable`` that each robot has seen with its own laser, also those that it
    forgot since."""

    def __init__(self, grid: GridSpec, reachable: np.ndarray) -> None:
        self._inside = tiles_of(grid, reachable.astype(np.uint8)) != 0
        self._before: dict[str, np.ndarray] = {}
        self._maps: dict[str, RobotMap | None] = {}

    def watch(self, robot: str, robot_map: RobotMap | None, now_ns: int) -> None:
        if robot in self._maps:
            self._before[robot] = self._seen(robot, self._maps[robot])
        self._maps[robot] = robot_map

    def summary(self, now_ns: int) -> Sample:
        """``duplicated_exploration``: the cells of G that at least two robots have seen, as a share
        of those that at least one has; ``robots_per_cell``: the mean number of robots that have
        seen each of these. None where there are none. A cell is seen where a robot's own scans make
        it free or occupied."""
        seen = np.zeros(self._inside.shape, np.int32)
        for robot, robot_map in self._maps.items():
            seen += self._seen(robot, robot_map)
        seen = seen[self._inside]
        anybody = np.count_nonzero(seen)
        if not anybody:
            return {"duplicated_exploration": None, "robots_per_cell": None}
        return {"duplicated_exploration": np.count_nonzero(seen > 1) / anybody,
                "robots_per_cell": int(seen.sum()) / anybody}

    def _seen(self, robot: str, robot_map: RobotMap | None) -> np.ndarray:
        """[tiles, 1024] bool."""
        seen = self._before.get(robot, np.zeros((1, CELLS), bool))
        if robot_map is None:
            return seen
        own = robot_map.own.snapshot().cells()
        return seen | (own <= FREE) | (own >= OCCUPIED)
