"""Queries of the map: frontiers, lengths of paths, expected information gain, rasters."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from desim.ports import Frontier, GridSpec, TeamArea
from desim.robot.mapping.tiles import FREE, OCCUPIED, occupancy, raster
from desim.robot.navigation.global_costmap import GlobalCostmap
from desim.robot.navigation.global_planner import GlobalPlanner
from desim.robot.navigation.kernels.information_gain import unknown_in_view
from desim.scenario.schema.robot import ExplorationParams


class MapQueries:
    """Queries of the map of one host as it is now. ``view_m``: the range of its laser in maps."""

    def __init__(self, costmap: GlobalCostmap, exploration: ExplorationParams, tolerance_m: float,
                 view_m: float) -> None:
        self.costmap, self.planner = costmap, GlobalPlanner(costmap)
        resolution_m = costmap.spec.resolution_m
        self.smallest = math.ceil(exploration.min_frontier_m / resolution_m)  # cells of a frontier
        self._tolerance_m = tolerance_m
        self._reach = int(view_m / resolution_m)
        self._met: np.ndarray | None = None
        self._stamp = 0

    @property
    def grid(self) -> GridSpec:
        """The raster of the map."""
        return self.costmap.spec

    @property
    def cells(self) -> int:
        """The number of cells of the costmap, all of which a search may reach."""
        return self.costmap.spec.cells

    def frontiers(self, from_m: tuple[float, float], limit: int | None, discs: np.ndarray
                  ) -> list[Frontier]:
        """Reachable frontiers in the order of ``path_m``; if there are none, also those that are
        too small or too near to obstacles. ``discs``: see ``GlobalPlanner.frontiers``."""
        return (self.planner.frontiers(from_m, limit, self.smallest, discs)
                or self.planner.all_frontiers(from_m, limit, discs))

    def path_lengths_m(self, from_m: tuple[float, float], places: Sequence[tuple[float, float]]
                       ) -> np.ndarray:
        """[n] costs of the cheapest paths to ``places``, as ``Frontier.path_m``; inf for none."""
        return self.planner.lengths_m(from_m, places, self._tolerance_m)

    def is_on_map(self, x_m: float, y_m: float) -> bool:
        """Whether a place is within the raster of the map."""
        column, row = self.grid.cell(x_m, y_m)
        return 0 <= column < self.grid.width and 0 <= row < self.grid.height

    def is_free(self, x_m: float, y_m: float) -> bool:
        """Whether the robot's centre may be there, or a tolerance away, as far as is known."""
        if not self.is_on_map(x_m, y_m):
            return False
        self.costmap.update()
        return self.costmap.free_near(x_m, y_m, self._tolerance_m) >= 0

    def gain_m2(self, x_m: float, y_m: float) -> float:
        """Unknown area that a laser would see from a place, if the unknown were free (the
        information gain of next-best-view planning: Gonzalez-Banos and Latombe 2002)."""
        costmap = self.costmap
        costmap.update()
        if self._met is None:
            self._met = np.zeros(len(costmap.flat), np.int32)
        self._stamp += 1
        count = unknown_in_view(costmap.flat, costmap.across, costmap.cell(x_m, y_m), self._reach,
                                self._met, self._stamp)
        return count * self.grid.resolution_m**2

    def known_m2(self) -> float:
        """The area of the cells that are free or occupied."""
        fused = self.costmap.robot_map.fused
        count = np.count_nonzero((fused <= FREE) | (fused >= OCCUPIED))
        return int(count) * self.grid.resolution_m**2

    def occupancy(self) -> np.ndarray:
        """[height, width] int8: 0 free, 100 occupied, -1 unknown; a copy."""
        return occupancy(self.grid, self.costmap.robot_map.fused)

    def seen_by(self, name: str) -> TeamArea | None:
        """The area that ``name`` has seen itself, as far as its maps have arrived, or None."""
        received = self.costmap.robot_map.received.get(name)
        if received is None:
            return None
        cells = raster(self.grid, received.cells())
        seen = (cells <= FREE) | (cells >= OCCUPIED)
        seen.flags.writeable = False
        return TeamArea(seen, received.newest)

    def costs(self) -> np.ndarray:
        """[height, width] uint8, costs of costmap_2d; a copy."""
        self.costmap.update()
        return self.costmap.values[1:-1, 1:-1].copy()
