"""One search from where the robot is, read twice: the nearest frontiers, and the way there."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from desim.ports import Frontier
from desim.robot.navigation import kernels
from desim.robot.navigation.costmap import INSCRIBED, Costmap
from desim.robot.navigation.kernels import BUCKETS, FAR

START_REACH_M = 1.0  # a robot that stands too near to something starts from a free cell so near
MOST_FRONTIERS = 4096  # of one search
_STRAIGHT, _DIAGONAL = 5, 7  # 7 / 5 is sqrt(2) within 1 %
_LONGEST_LEG_M = 8.0  # of a straightened way; bounds the work, and no line of sight is longer here

# A step costs neutral + 0.8 * cost of the cell with neutral 50 (navfn, COST_NEUTRAL, COST_FACTOR).
_FACTOR = 0.8 / 50.0


def _toll(squeezing: bool) -> np.ndarray:
    """[2, 256] cost of a straight and a diagonal step into a cell of a given cost, 0 = impassable.
    ``squeezing`` goes through inscribed cells too, at the highest cost that the buckets hold."""
    costs = np.arange(256)
    toll = np.zeros((2, 256), np.int32)
    for row, length in zip(toll, (_STRAIGHT, _DIAGONAL), strict=True):
        row[:INSCRIBED] = (length * (1 + _FACTOR * costs[:INSCRIBED])).astype(np.int32)
        row[INSCRIBED] = BUCKETS - 1 if squeezing else 0
    return toll


_WALKING, _SQUEEZING = _toll(False), _toll(True)
_NO_DISCS = np.zeros((0, 3), np.int64)


class _Room:
    """Arrays that one search at a time works in, shared by all robots with maps of one size.

    ``last`` says whose search is in them: (costmap, its version, start, settled up to)."""

    def __init__(self, cells: int) -> None:
        self.distance = np.empty(cells, np.int32)
        self.seen = np.empty(cells, np.uint8)
        self.stack = np.empty(cells, np.int32)
        self.way = np.empty(cells, np.int32)
        self.points = np.empty((cells, 2))
        self.buckets = np.empty((BUCKETS, cells), np.int32)  # touched only as far as it is filled
        self.found = np.empty((MOST_FRONTIERS, 3), np.int64)
        self.last: tuple | None = None


_room = lru_cache(maxsize=4)(_Room)


class Wavefront:
    """Searches over one robot's costmap."""

    def __init__(self, costmap: Costmap) -> None:
        self.costmap = costmap
        self._room = _room(len(costmap.flat))

    def plan(self, from_m: tuple[float, float], to_m: tuple[float, float],
             tolerance_m: float) -> np.ndarray | None:
        """Way points [n, 2] in m of the cheapest way, n >= 1, or None if there is none. It ends at
        the free cell nearest to ``to_m``, at most ``tolerance_m`` away."""
        costmap, room = self.costmap, self._room
        costmap.update()
        start = costmap.free_near(*from_m, START_REACH_M)
        goal = costmap.free_near(*to_m, tolerance_m)
        if start < 0 or goal < 0:
            return None
        if not self._settled(start, goal):
            reached = self._spread(_WALKING, start, goal, 0, 0, _NO_DISCS)
            room.last = (costmap, costmap.seen, start, room.distance[goal] if reached else FAR - 1)
            if not reached:
                return None
        spec = costmap.spec
        count = kernels.trace_back(costmap.flat, costmap.across, _WALKING, room.distance, goal,
                                   room.way)
        count = kernels.straighten(costmap.flat, costmap.across, room.way, count,
                                   int(_LONGEST_LEG_M / spec.resolution_m), spec.resolution_m,
                                   spec.x_m, spec.y_m, room.points)
        return room.points[:count].copy()

    def frontiers(self, from_m: tuple[float, float], limit: int | None, smallest: int,
                  discs: np.ndarray = _NO_DISCS) -> list[Frontier]:
        """Frontier clusters of at least ``smallest`` cells in the order of the cost of the way to
        their nearest cell, which is the one to drive to; at most ``limit``. ``path_m`` is that
        cost as a length: detours around obstacles' margins count for more.

        ``discs`` int64 [k, 3], row, column and squared radius in cells, are left out."""
        costmap, room = self.costmap, self._room
        costmap.update()
        start = costmap.free_near(*from_m, START_REACH_M)
        if start < 0:
            return []
        limit = min(limit or MOST_FRONTIERS, MOST_FRONTIERS)
        count = self._spread(_WALKING, start, -1, limit, smallest, discs)
        settled = room.found[count - 1, 1] if count == limit else FAR - 1
        room.last = (costmap, costmap.seen, start, settled)
        return [self._frontier(cell, distance, cells)
                for cell, distance, cells in room.found[:count].tolist()]

    def hidden_frontiers(self, from_m: tuple[float, float], limit: int | None,
                         discs: np.ndarray = _NO_DISCS) -> list[Frontier]:
        """As ``frontiers``, of any size, and also those so near to obstacles that the robot's
        centre cannot get there: the cell to drive to is then the last possible one before, and
        must not lie in ``discs`` either."""
        costmap, room = self.costmap, self._room
        costmap.update()
        start = costmap.free_near(*from_m, START_REACH_M)
        if start < 0:
            return []
        count = self._spread(_SQUEEZING, start, -1, MOST_FRONTIERS, 1, discs)
        room.last = None
        hidden = [(self._last_free(cell), distance, cells)
                  for cell, distance, cells in room.found[:count].tolist()]
        row, column = np.divmod(np.array([cell for cell, _, _ in hidden], np.int64)[:, None],
                                costmap.across)
        avoided = ((row - discs[:, 0])**2 + (column - discs[:, 1])**2 <= discs[:, 2]).any(axis=1)
        return [self._frontier(*entry) for entry, skip in zip(hidden, avoided, strict=True)
                if not skip][:limit]

    def _spread(self, toll: np.ndarray, start: int, goal: int, limit: int, smallest: int,
                discs: np.ndarray) -> int:
        room, costmap = self._room, self.costmap
        return kernels.spread(costmap.flat, costmap.across, toll, start, goal, limit, smallest,
                              discs, room.distance, room.seen, room.stack, room.buckets,
                              room.found)

    def _settled(self, start: int, goal: int) -> bool:
        """Whether the last search of all was this robot's from here, and got as far as ``goal``: as
        when it has just looked for frontiers. The way is the same as a new search would find."""
        last = self._room.last
        return (last is not None and last[0] is self.costmap and last[1] == self.costmap.seen
                and last[2] == start and self._room.distance[goal] <= last[3])

    def _last_free(self, cell: int) -> int:
        count = kernels.trace_back(self.costmap.flat, self.costmap.across, _SQUEEZING,
                                   self._room.distance, cell, self._room.way)
        way = self._room.way[:count]
        return int(way[np.argmax(self.costmap.flat[way] < INSCRIBED)])

    def _frontier(self, cell: int, distance: int, cells: int) -> Frontier:
        x_m, y_m = self.costmap.centre(cell)
        return Frontier(x_m, y_m, distance / _STRAIGHT * self.costmap.spec.resolution_m, cells)
