"""The global planner: one search that begins at the robot finds frontiers, and paths to them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from weakref import ReferenceType, ref

import numpy as np

from desim.compiler.kernel import compiled_function
from desim.ports import Frontier
from desim.robot.navigation.global_costmap import INSCRIBED, GlobalCostmap
from desim.robot.navigation.kernels import global_planner as kernels
from desim.robot.navigation.kernels.global_planner import BUCKETS

_spread = compiled_function(kernels.spread)
_trace_back = compiled_function(kernels.trace_back)
_straighten = compiled_function(kernels.straighten)

# Search radius for a free cell to start from, for a robot too near to an obstacle; maze_8: same.
START_REACH_M = 1.0
# Distance of the aim from a frontier's nearest cell, often a wall's end; maze_8: 190, 180 s.
_INWARD_M = 2.0
# Most distance from which a frontier beside an obstacle is observed; maze_8: 192, 192 s.
_STAND_OFF_M = 1.0
# Highest cost at such a place: that 0.2 m beyond the robot's radius (costmap_2d); maze_8: 192,
# 188 s.
_AT_EASE = 34
MOST_FRONTIERS = 4096  # of one search
_STRAIGHT, _DIAGONAL = 5, 7  # 7 / 5 is sqrt(2) within 1 %
_LONGEST_LEG_M = 8.0  # of a straightened path, to bound the work; maze_8: 194, 195 s

# A step costs neutral + 0.8 * cost of the cell with neutral 50 (navfn, COST_NEUTRAL, COST_FACTOR).
_FACTOR = 0.8 / 50.0


def _toll(squeezing: bool) -> np.ndarray:
    """[2, 256] cost of a straight and a diagonal step into a cell of a given cost, 0 = impassable.
    ``squeezing`` goes through inscribed cells too, at the highest cost that the buckets hold."""
    toll = np.zeros((2, 256), np.int32)
    for row, length in zip(toll, (_STRAIGHT, _DIAGONAL), strict=True):
        row[:INSCRIBED] = (length * (1 + _FACTOR * np.arange(INSCRIBED))).astype(np.int32)
        row[INSCRIBED] = BUCKETS - 1 if squeezing else 0
    return toll


_WALKING, _SQUEEZING = _toll(False), _toll(True)
_NO_DISCS = np.zeros((0, 3), np.int64)
_NO_GOALS = np.zeros(0, np.int64)


class _Arrays:
    """The arrays that one search at a time works in, shared by all robots with maps of one size.

    ``last`` is the search whose result they hold, if it can be read: the costmap, its edition, the
    start, and the cost up to which all cells are settled. The reference is weak: these arrays
    outlive a run, all of whose objects hang together with its costmaps."""

    def __init__(self, cells: int) -> None:
        self.search = kernels.Search(
            np.empty(cells, np.int32), np.empty(cells, np.uint8), np.empty(cells, np.int32),
            np.empty((BUCKETS, cells), np.int32),  # touched only as far as it is filled
            np.array([0, cells]), np.empty((MOST_FRONTIERS, 2), np.int64))
        self.way = np.empty(cells, np.int32)
        self.points = np.empty((cells, 2))
        self.last: tuple[ReferenceType[GlobalCostmap], int, int, int] | None = None


_arrays = lru_cache(maxsize=4)(_Arrays)


class GlobalPlanner:
    """Finds paths and frontiers on one robot's costmap."""

    def __init__(self, costmap: GlobalCostmap) -> None:
        self.costmap = costmap
        self._arrays = _arrays(len(costmap.flat))
        self._edges: dict[Frontier, tuple[int, int]] = {}  # of the last search

    def plan(self, from_m: tuple[float, float], to_m: tuple[float, float],
             tolerance_m: float) -> np.ndarray | None:
        """Way points [n, 2] in m of the cheapest path, n >= 1, or None if there is none. It ends at
        the free cell nearest to ``to_m``, at most ``tolerance_m`` away."""
        costmap, arrays = self.costmap, self._arrays
        costmap.update()
        start = costmap.free_near(*from_m, START_REACH_M)
        goal = costmap.free_near(*to_m, tolerance_m)
        if start < 0 or goal < 0:
            return None
        self._settle(start, np.array([goal]))
        if arrays.search.distance[goal] == kernels.FAR:
            return None
        spec = costmap.spec
        count = _trace_back(costmap.flat, costmap.across, _WALKING, arrays.search.distance, goal,
                            arrays.way)
        count = _straighten(costmap.flat, costmap.across, arrays.way, count,
                            int(_LONGEST_LEG_M / spec.resolution_m), spec.resolution_m, spec.x_m,
                            spec.y_m, arrays.points)
        return arrays.points[:count].copy()

    def lengths_m(self, from_m: tuple[float, float], places: Sequence[tuple[float, float]],
                  tolerance_m: float) -> np.ndarray:
        """[n] costs of the cheapest paths to ``places``, in metres of free cells; inf where there
        is none. A path ends as that of ``plan``."""
        costmap = self.costmap
        costmap.update()
        lengths_m = np.full(len(places), np.inf)
        start = costmap.free_near(*from_m, START_REACH_M)
        goals = np.array([costmap.free_near(*place, tolerance_m) for place in places], np.int64)
        is_free = goals >= 0
        if start < 0 or not is_free.any():
            return lengths_m
        self._settle(start, goals[is_free])
        costs = self._arrays.search.distance[goals]
        is_met = is_free & (costs < kernels.FAR)
        lengths_m[is_met] = costs[is_met] / _STRAIGHT * costmap.spec.resolution_m
        return lengths_m

    def frontiers(self, from_m: tuple[float, float], limit: int | None, smallest: int,
                  discs: np.ndarray = _NO_DISCS) -> list[Frontier]:
        """Frontier clusters of at least ``smallest`` cells in the order of ``path_m``. With a
        ``limit``, those that the search meets first.

        The search meets a cluster at one of its cells. The robot drives to a cell of the cluster a
        few steps from there, or, if that one is beside an obstacle, to one before it on the path.
        ``path_m`` is the cost of the path to the cell of the cluster, in metres of free cells:
        steps in obstacles' margins count for more.
        Cells in ``discs`` (int64 [k, 3]: row, column, squared radius in cells) are no frontiers.
        """
        return [frontier for frontier, _ in
                self._search(_WALKING, from_m, limit, smallest, discs)]

    def all_frontiers(self, from_m: tuple[float, float], limit: int | None,
                      discs: np.ndarray = _NO_DISCS) -> list[Frontier]:
        """All frontier clusters, also the smallest ones and those too near to obstacles for the
        robot's centre. The cell to drive to must not lie in ``discs`` either."""
        found = self._search(_SQUEEZING, from_m, None, 1, discs)
        row, column = np.divmod(np.array([goal for _, goal in found], np.int64)[:, None],
                                self.costmap.across)
        avoided = ((row - discs[:, 0])**2 + (column - discs[:, 1])**2 <= discs[:, 2]).any(axis=1)
        return [frontier for (frontier, _), skip in zip(found, avoided, strict=True)
                if not skip][:limit]

    def frontier_at(self, x_m: float, y_m: float) -> Frontier | None:
        """The frontier of the last search for which the robot drives to this place, or None."""
        return next((one for one in self._edges if one[:2] == (x_m, y_m)), None)

    def edge_of(self, frontier: Frontier) -> tuple[int, int]:
        """The cell of its cluster that a frontier of the last search stands for, at the edge of the
        unknown, and the highest cost that cells of the cluster may have."""
        return (self._edges.get(frontier)
                or (self.costmap.cell(frontier.x_m, frontier.y_m), INSCRIBED))

    def _search(self, toll: np.ndarray, from_m: tuple[float, float], limit: int | None,
                smallest: int, discs: np.ndarray) -> list[tuple[Frontier, int]]:
        """Frontiers, each with the cell to drive to."""
        self.costmap.update()
        self._edges = {}
        start = self.costmap.free_near(*from_m, START_REACH_M)
        if start < 0:
            return []
        count = self._spread(toll, start, _NO_GOALS, min(limit or MOST_FRONTIERS, MOST_FRONTIERS),
                             smallest, discs)
        found = [self._read(toll, cell, cells)
                 for cell, cells in self._arrays.search.found[:count].tolist()]
        return sorted(found, key=lambda entry: entry[0].path_m)

    def _spread(self, toll: np.ndarray, start: int, goals: np.ndarray, limit: int, smallest: int,
                discs: np.ndarray) -> int:
        """Run ``kernels.spread``. Returns the number of clusters found."""
        arrays, costmap = self._arrays, self.costmap
        count, settled = _spread(
            costmap.flat, costmap.across, toll, start, goals, limit, smallest,
            int(_INWARD_M / costmap.spec.resolution_m), discs, arrays.search)
        arrays.last = (ref(costmap), costmap.edition, start, settled) if toll is _WALKING else None
        return count

    def _settle(self, start: int, goals: np.ndarray) -> None:
        """Search from ``start`` until all ``goals`` [k] that can be reached are settled, unless the
        last search settled them. It often did, as when the robot has just searched for frontiers.
        Its costs and paths are those that a new search would find."""
        last, distance = self._arrays.last, self._arrays.search.distance
        if last is None or last[:3] != (ref(self.costmap), self.costmap.edition, start) or (
                last[3] < kernels.FAR - 1 and (distance[goals] > last[3]).any()):
            self._spread(_WALKING, start, goals, 0, 0, _NO_DISCS)

    def _read(self, toll: np.ndarray, cell: int, cells: int) -> tuple[Frontier, int]:
        """The frontier of a cluster just found, and the cell to drive to: the last one on the path
        to ``cell`` that is outside of the margins of obstacles, if that is near."""
        costmap, arrays = self.costmap, self._arrays
        length = _trace_back(costmap.flat, costmap.across, toll, arrays.search.distance, cell,
                             arrays.way)
        near = arrays.way[:min(length, int(_STAND_OFF_M / costmap.spec.resolution_m) + 1)]
        costs = costmap.flat[near]
        at_ease = costs <= _AT_EASE
        goal = int(near[np.argmax(at_ease) if at_ease.any() else np.argmin(costs)])
        path_m = int(arrays.search.distance[cell]) / _STRAIGHT * costmap.spec.resolution_m
        frontier = Frontier(*costmap.centre(goal), path_m, cells)
        self._edges[frontier] = cell, INSCRIBED if toll is _SQUEEZING else INSCRIBED - 1
        return frontier, goal
