"""Coverage: the part of the terrain that the fleet knows, counted as it learns.

With the equations of Yan, Fabresse, Laval and Bouraqadi (2017), section 3.3.

G is the set of free cells that a laser can reach from the start positions. A robot's map is the
sum of its layers; the union is what some robot has known at some time. Log-odds may fall back
between the thresholds, so that a robot's count can also shrink; the union's never does.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from desim.compiler.kernel import compiled_function
from desim.monitor import kernels
from desim.ports.tasks import Ground
from desim.robot.mapping.tiles import FREE, OCCUPIED, TILE, raster, tiles_of

_recount = compiled_function(kernels.recount)

EXPLORED = 0.99  # the share at which the paper calls a terrain explored (3.3.1)


def states(log_odds: np.ndarray) -> np.ndarray:
    """Log-odds to int8: 0 free, 100 occupied, -1 unknown (the values of nav_msgs/OccupancyGrid)."""
    out = np.full(log_odds.shape, -1, np.int8)
    out[log_odds <= FREE] = 0
    out[log_odds >= OCCUPIED] = 100
    return out


class Coverage:
    """The cells of G that each robot's map knows, kept up to date with every change.

    ``robots`` are the names of those with a map, in index order. ``changed(i)`` is called after
    robot i's count was brought up to date. Reading a share costs no more than an access.
    """

    def __init__(self, ground: Ground, robots: tuple[str, ...],
                 changed: Callable[[int], None] = lambda i: None) -> None:
        self.robots = robots
        self.cells = int(ground.reachable.sum())
        self.known = [0] * len(robots)
        self.union_known = 0
        self._changed, self._grid = changed, ground.grid
        self._inside = tiles_of(ground.grid, ground.reachable.astype(np.uint8))
        self._union = np.zeros_like(self._inside)
        self._counts = np.zeros((len(robots) + 1, len(self._inside), TILE), np.uint8)
        self._totals = np.zeros(len(robots) + 1, np.int64)

    def restart(self, i: int) -> None:
        """Robot ``i`` knows nothing (any more)."""
        self.known[i] = self._counts[i] = self._totals[i] = 0
        self._changed(i)

    def update(self, i: int, fused: np.ndarray, tile_version: np.ndarray, row_version: np.ndarray,
               tiles: np.ndarray) -> None:
        """Count again ``tiles`` (int32 indices) of robot ``i``'s map, whose arrays the others are,
        in the rows that changed with their tile."""
        totals = _recount(fused, self._inside, tile_version, row_version, tiles, i, self._union,
                          self._counts, self._totals)
        self.known[i] = totals >> 32
        self.union_known = totals & 0xFFFFFFFF
        self._changed(i)

    @property
    def known_to_some(self) -> tuple[np.ndarray, np.ndarray]:
        """uint8 [tiles, 1024] each: 1 for cells of G, and for those that some robot has known."""
        return self._inside, self._union

    def explored(self) -> np.ndarray:
        """[height, width] bool: the cells of G that some robot has known."""
        return raster(self._grid, self._union) != 0

    def cells_for(self, share: float) -> int:
        """The fewest cells that make at least ``share`` of G."""
        return math.ceil(share * self.cells - 1e-9)

    def share(self, cells: int) -> float:
        """A count of cells as a share of G; 1 where there is nothing to explore."""
        return cells / self.cells if self.cells else 1.0


class Reached:
    """First instants at which so many cells are known: to ``any`` one of the robots, to the
    ``union`` of them, to ``all`` of them at the same time. None while that has not happened."""

    def __init__(self, cells: int, robots: int) -> None:
        self.cells = cells
        self.first_ns: dict[str, int | None] = {"any": None, "union": None, "all": None}
        self.first_robot: int | None = None
        self._there = [False] * robots
        self._missing = robots

    def update(self, i: int, known: int, union_known: int, now_ns: int) -> None:
        """Robot ``i`` knows ``known`` cells now, and the union ``union_known``."""
        if (known >= self.cells) is not self._there[i]:
            self._there[i] = not self._there[i]
            self._missing += -1 if self._there[i] else 1
            if self.first_robot is None:
                self.first_robot = i
                self.first_ns["any"] = now_ns
            if self._missing == 0 and self.first_ns["all"] is None:
                self.first_ns["all"] = now_ns
        if union_known >= self.cells and self.first_ns["union"] is None:
            self.first_ns["union"] = now_ns


def evaluate(ground: Ground, log_odds: np.ndarray, distances_m: list[float], collisions: int,
             safety_scale: int, cost: float | None) -> dict[str, float | None]:
    """Equations 1 to 5 of the paper for a map, int16 ``log_odds`` [height, width], by the names of
    the metrics.

    cost = sum of d_i [m] (1) | efficiency = A / cost [m2/m] (2) | safety = 1 - sum of s_i / S (3) |
    completeness = A / G (4) | quality = (A - error w) / G (5), with A the area of G that the map
    knows, s_i the collisions of robot i, S ``safety_scale``, error the number of known cells, free
    or wall, inside G or not, whose state differs from the truth, and w the area of a cell. ``cost``
    takes the place of (1) in the metrics without a unit in their names.
    """
    state = states(log_odds)
    known = state >= 0
    known_cells = int(np.count_nonzero(known & ground.reachable))
    error = int(np.count_nonzero(known & ((state > 0) != (ground.solid != 0))))
    reachable = int(ground.reachable.sum())
    cost_m = math.fsum(distances_m)
    area_m2 = known_cells * ground.cell_m2
    return {
        "explored_area_m2": area_m2,
        "exploration_cost_m": cost_m,
        "exploration_efficiency_m2_per_m": area_m2 / cost_m if cost_m > 0.0 else None,
        "exploration_cost": cost,
        "exploration_efficiency": area_m2 / cost if cost is not None and cost > 0.0 else None,
        "safety": 1.0 - collisions / safety_scale,
        "map_completeness": known_cells / reachable if reachable else 1.0,
        "map_quality": (known_cells - error) / reachable if reachable else 1.0,
        "map_error_cells": error}
