"""Loops of the global planner: one search, for paths and for frontiers.

``flat``, ``across`` and cells are those of the global costmap's loops. ``toll`` [2, 256] is the
cost of a step (straight, diagonal) into a cell by its cost, 0 = impassable.
"""

from typing import NamedTuple

import numpy as np

from desim.ports.kernels import inner, kernel, lean, types
from desim.robot.navigation.kernels.global_costmap import beside_unknown, is_cheap_line

BUCKETS = 64  # more than the dearest step of any toll
FAR = 2**31 - 1  # the distance of a cell that the search has not met


class Search(NamedTuple):
    """The arrays of a search: ``distance`` [cells], out, of settled cells | ``seen``, ``queue``
    [cells] and ``buckets`` [BUCKETS, cells] to work in | ``used`` [2], in and out: the first cell
    of distance and seen that the last search wrote to, and the end | ``found`` [clusters, 2], out:
    the cell that stands for a cluster, and the number of its cells."""

    distance: np.ndarray
    seen: np.ndarray
    queue: np.ndarray
    buckets: np.ndarray
    used: np.ndarray
    found: np.ndarray


_i8 = types.int64
SEARCH = types.NamedTuple([types.int32[::1], types.uint8[::1], types.int32[::1],
                           types.int32[:, ::1], _i8[::1], _i8[:, ::1]], Search)


@inner("b1(u1[::1], i8, i4[:,::1], i8, i8[:,::1])")
def is_frontier(flat, across, toll, cell, discs):
    """Whether a cell is part of a frontier: it is passable, one of its four neighbours is unknown,
    and it is in none of ``discs`` [k, 3] (row, column, squared radius in cells)."""
    if toll[0, flat[cell]] == 0 or not beside_unknown(flat, across, cell):
        return False
    row, column = cell // across, cell % across
    for k in range(len(discs)):
        if (row - discs[k, 0])**2 + (column - discs[k, 1])**2 <= discs[k, 2]:
            return False
    return True


@inner("i8(u1[::1], i8, i4[:,::1], i8, i8[:,::1], u1[::1], i4[::1])")
def cluster(flat, across, toll, seed, discs, seen, queue):
    """Write the frontier cells that are connected with ``seed`` (8 neighbours) to ``queue``, in the
    order of their number of steps from it, and mark them in ``seen``. Returns their number, which
    is the size of the frontier."""
    queue[0], size, k = seed, 1, 0
    seen[seed] = 1
    while k < size:
        for dr in range(-1, 2):
            for dc in range(-1, 2):
                near = queue[k] + dr * across + dc
                if seen[near] == 0 and is_frontier(flat, across, toll, near, discs):
                    seen[near] = 1
                    queue[size] = near
                    size += 1
        k += 1
    return size


@kernel(types.UniTuple(_i8, 2)(types.uint8[::1], _i8, types.int32[:, ::1], _i8, _i8[::1],
                               *[_i8] * 3, types.int64[:, ::1], SEARCH))
def spread(flat, across, toll, start, goals, limit, smallest, inward, discs, search):
    """Dijkstra's search from ``start``, with integer costs in circular buckets (Dial 1969). It ends
    when all ``goals`` [k] are settled, or ``limit`` frontier clusters, or all cells in reach.

    ``goals``: none where frontiers are wanted | ``limit``: 0 if no frontiers are wanted |
    ``smallest``: the number of cells from which a cluster counts | ``inward``: the number of its
    cells, at most half of them, between the one that the search met first and the one that stands
    for the cluster.
    Returns the number of clusters found, and the cost up to which all is settled.
    """
    distance, seen, queue, buckets, used, found = search
    distance[used[0]:used[1]] = FAR
    seen[used[0]:used[1]] = 0
    low = high = start
    filled = np.zeros(BUCKETS, np.int64)
    straight, diagonal, least = toll[0], toll[1], toll[0, 0]
    # Unsigned, as cells are: numba then needs no test for < 0.
    up, right = np.uint64(across), np.uint64(1)
    around = (np.uint64(-across), np.uint64(-1), right, up, np.uint64(-across - 1),
              np.uint64(1 - across), up - right, up + right)
    distance[start], buckets[0, 0], filled[0] = 0, start, 1
    waiting, far, count, open_, going = 1, 0, 0, 0, True
    for goal in goals:
        low, high = min(low, goal), max(high, goal)
        if seen[goal] == 0:
            seen[goal] = 2
            open_ += 1
    ends = limit > 0 or open_ > 0
    while waiting > 0 and going:
        b, k = far & BUCKETS - 1, 0
        settled = np.int32(far + least)
        while k < filled[b]:  # no step is free, so nothing joins this bucket meanwhile
            cell = np.uint64(buckets[b, np.uint64(k)])
            k += 1
            if distance[cell] != far:
                continue
            if count < limit and beside_unknown(flat, across, cell) and seen[cell] == 0 \
                    and is_frontier(flat, across, toll, cell, discs):
                size = cluster(flat, across, toll, cell, discs, seen, queue)
                for met in queue[:size]:
                    low, high = min(low, met), max(high, met)
                if size >= smallest:
                    aim = queue[min(inward, size // 2)]
                    found[count, 0], found[count, 1] = aim, size
                    count += 1
                    if aim == cell or distance[aim] > far:  # else it is settled already
                        seen[aim] = 2
                        open_ += 1
            if seen[cell] > 0:
                if seen[cell] == 2:
                    open_ -= 1
                if ends and count == limit and open_ == 0:
                    going = False
                    break
            low, high = min(low, np.int64(cell)), max(high, np.int64(cell))
            for n in range(8):
                near = cell + around[n]
                if distance[near] <= settled:
                    continue
                step = straight[flat[near]] if n < 4 else diagonal[flat[near]]
                if step > 0 and far + step < distance[near]:
                    distance[near] = far + step
                    target = np.uint64(far + step & BUCKETS - 1)
                    buckets[target, np.uint64(filled[target])] = near
                    filled[target] += 1
                    waiting += 1
        waiting -= filled[b]
        filled[b] = 0
        far += 1
    used[0], used[1] = low - across - 1, high + across + 2
    return count, FAR - 1 if going else far - 1


@lean("i8(u1[::1], i8, i4[:,::1], i4[::1], i8, i4[::1])")
def trace_back(flat, across, toll, distance, goal, way):
    """Write the cells of a cheapest path from the start of the last ``spread`` to the settled
    ``goal`` to ``way``, goal first. Returns their number."""
    way[0], count, cell = goal, 1, goal
    while distance[cell] > 0:
        for k in range(9):
            dr, dc = k // 3 - 1, k % 3 - 1
            near = cell + dr * across + dc
            if distance[near] != FAR and \
                    distance[near] + toll[dr & dc & 1, flat[cell]] == distance[cell]:
                cell = near
                break
        way[count] = cell
        count += 1
    return count


@lean("i8(u1[::1], i8, i4[::1], i8, i8, f8, f8, f8, f8[:,::1])")
def straighten(flat, across, way, count, longest, cell_m, x_m, y_m, points):
    """Write way points of ``way`` (goal first) from the start on to ``points`` [k, 2], x, y in m:
    each the farthest cell, up to ``longest`` cells ahead, that a straight line reaches without
    meeting a higher cost than ``way`` does. Returns their number."""
    anchor, n = count - 1, 0
    while True:
        cell = way[anchor]
        points[n, 0] = x_m + (cell % across - 0.5) * cell_m
        points[n, 1] = y_m + (cell // across - 0.5) * cell_m
        n += 1
        if anchor == 0:
            return n
        best, allowed = anchor - 1, flat[way[anchor - 1]]
        for k in range(anchor - 2, max(anchor - longest, 0) - 1, -1):
            allowed = max(allowed, flat[way[k]])
            if is_cheap_line(flat, across, way[anchor], way[k], allowed):
                best = k
        anchor = best
