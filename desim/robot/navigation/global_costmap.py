"""The global costmap: a robot's map, with a margin of costs around obstacles (costmap_2d)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from desim.compiler.kernel import compiled_function
from desim.middleware.contents import no_return_m
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.navigation.kernels import global_costmap as kernels
from desim.robot.navigation.kernels.global_costmap import FRAME, INSCRIBED, LETHAL, UNKNOWN
from desim.robot.navigation.scan_points import Directions, PlacedScan, seen_from

__all__ = ["INSCRIBED", "LETHAL", "UNKNOWN", "GlobalCostmap", "inflated_cost"]

_classify = compiled_function(kernels.classify)
_inflate = compiled_function(kernels.inflate)
_see = compiled_function(kernels.see)
_nearest_free = compiled_function(kernels.nearest_free)
_is_cheap_line = compiled_function(kernels.is_cheap_line)
_count_frontier_cells = compiled_function(kernels.count_frontier_cells)

# A beam clears and its hit marks up to these distances (costmap_2d, raytrace_range and
# obstacle_range: its defaults, and the published explore_costmap.yaml).
CLEAR_M, MARK_M = 3.0, 2.5


def inflated_cost(distance_m: float, radius_m: float, scaling: float) -> int:
    """The cost of a free cell at ``distance_m`` from an obstacle: inscribed within the robot's
    radius, else 252 exp(-scaling (distance - radius)) (costmap_2d, inflation_layer.h)."""
    if distance_m <= radius_m:
        return INSCRIBED
    return int((INSCRIBED - 1) * math.exp(-scaling * (distance_m - radius_m)))


@lru_cache(maxsize=16)  # robots of one type have one
def _stencil(cell_m: float, reach: int, radius_m: float, inflation_radius_m: float, scaling: float
             ) -> np.ndarray:
    """[k, 3] row, column and cost of the cells around an obstacle, up to ``reach`` cells away."""
    offsets = range(-reach, reach + 1)
    near = ((r, c, math.hypot(r, c) * cell_m) for r in offsets for c in offsets)
    return np.array([(r, c, inflated_cost(d, radius_m, scaling))
                     for r, c, d in near if 0 < d <= inflation_radius_m], np.int64).reshape(-1, 3)


class GlobalCostmap:
    """Costs of a map's cells.

    ``update`` brings them up to date. It is called before a search, not at each change of the map,
    and reads only the rows of tiles that have changed since it was last called. ``see`` adds what
    the lasers see at the moment, until the map changes there.

    ``values`` uint8 [height + 2, width + 2] with a lethal rim one cell wide | ``flat`` the same as
    one line: a *cell* is its place there | ``frame`` one record of ``FRAME`` | ``edition`` counts
    the changes of ``values``
    """

    def __init__(self, robot_map: RobotMap, radius_m: float, inflation_radius_m: float,
                 inflation_scaling: float) -> None:
        spec = robot_map.spec
        self.robot_map, self.spec = robot_map, spec
        self.values = np.full((spec.height + 2, spec.width + 2), LETHAL, np.uint8)
        self.values[1:-1, 1:-1] = UNKNOWN
        self.flat = self.values.reshape(-1)
        self.across = spec.width + 2
        self.frame = np.array([(spec.x_m, spec.y_m, spec.resolution_m, spec.width + 2,
                                spec.height + 2)], FRAME)
        self.seen = 0  # the map's version as of the last update
        self.edition = 0
        self._radius_m = radius_m
        self._beams = Directions()
        self._reach = math.floor(inflation_radius_m / spec.resolution_m)
        self._stencil = _stencil(spec.resolution_m, self._reach, radius_m, inflation_radius_m,
                                 inflation_scaling)
        self._boxes = np.zeros((len(robot_map.fused), 4), np.int64)

    def update(self) -> None:
        """Take in the map's changes since the last update."""
        robot_map = self.robot_map
        if robot_map.version == self.seen:
            return
        count = _classify(robot_map.fused, robot_map.tile_version, robot_map.row_version, self.seen,
                          robot_map.tiles_x, self._reach, self.values, self._boxes)
        _inflate(self._boxes, count, self._stencil, self._reach, self.values)
        self.seen = robot_map.version
        self.edition += 1

    def see(self, scans: Sequence[PlacedScan]) -> None:
        """Take in the robot's surroundings as they are now, as costmap_2d's obstacle layer does:
        what beams cross is free, hits are obstacles, and the robot itself stands on none
        (``Costmap2DROS::clearRobotFootprint``)."""
        scan, pose = scans[0]
        if len(scans) == 1 and scan.x_m == scan.y_m == 0.0:
            ranges, beams, longest_m = scan.ranges, self._beams.of(scan)[0], scan.range_max_m
        else:
            (ranges, beams), longest_m = seen_from(scans, self._beams), math.inf
        _see(ranges, beams, pose, no_return_m(longest_m),
             (CLEAR_M, MARK_M, self._radius_m), self.frame, self.flat)
        row, column = divmod(self.cell(*pose[:2]), self.across)
        width = math.ceil(CLEAR_M / self.spec.resolution_m) + 1 + self._reach
        self._boxes[0] = (max(row - width, 1), min(row + width, self.spec.height) + 1,
                          max(column - width, 1), min(column + width, self.spec.width) + 1)
        _inflate(self._boxes, 1, self._stencil, self._reach, self.values)
        self.edition += 1

    def changed_near(self, cell: int, reach: int, since: int) -> bool:
        """Whether the map changed after its version ``since`` in a tile of the square of ``reach``
        cells around ``cell``."""
        row, column = divmod(cell, self.across)
        width, height = self.spec.width, self.spec.height
        tiles_x, changed = self.robot_map.tiles_x, self.robot_map.tile_version
        columns = range(max(column - reach, 1) - 1 >> 5, (min(column + reach, width) - 1 >> 5) + 1)
        for across in range(max(row - reach, 1) - 1 >> 5, (min(row + reach, height) - 1 >> 5) + 1):
            for along in columns:
                if changed[across * tiles_x + along] > since:
                    return True
        return False

    def cell(self, x_m: float, y_m: float) -> int:
        """The cell of a point, or the nearest one to a point outside of the map."""
        column, row = self.spec.cell(x_m, y_m)
        column = min(max(column, 0), self.spec.width - 1)
        return (min(max(row, 0), self.spec.height - 1) + 1) * self.across + column + 1

    def centre(self, cell: int) -> tuple[float, float]:
        """x, y in m of a cell's centre."""
        row, column = divmod(int(cell), self.across)
        resolution_m = self.spec.resolution_m
        return (self.spec.x_m + (column - 0.5) * resolution_m,
                self.spec.y_m + (row - 0.5) * resolution_m)

    def free_near(self, x_m: float, y_m: float, reach_m: float) -> int:
        """The nearest cell on which the robot's centre may be, at most ``reach_m`` away, or -1."""
        return _nearest_free(self.flat, self.across, self.cell(x_m, y_m),
                             int(reach_m / self.spec.resolution_m))

    def clear_line(self, a_m: tuple[float, float], b_m: tuple[float, float]) -> bool:
        """Whether the robot's centre may go straight from one point to another."""
        return _is_cheap_line(self.flat, self.across, self.cell(*a_m), self.cell(*b_m),
                              INSCRIBED - 1)

    def count_frontier_cells(self, cell: int, reach: int, highest: int) -> int:
        """The number of cells beside the unknown, of cost ``highest`` or less, in the square of
        ``reach`` cells around a cell."""
        return _count_frontier_cells(self.flat, self.across, cell, reach, highest)
