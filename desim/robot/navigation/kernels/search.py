"""Loops of the global costmap, and of the one search that serves plans and frontiers.

``cost`` is the padded costmap [height + 2, width + 2], or ``flat``, the same as one line: 0..252
free, ``INSCRIBED`` free but too near to an obstacle for the robot's centre, ``LETHAL`` an obstacle,
``UNKNOWN``. The padding is lethal, so that no loop has to look for the rim; it inflates nothing.
A cell is its place in ``flat``, whose rows are ``across`` cells long.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from desim.ports.kernels import lean

TILE = 32
INSCRIBED, LETHAL, UNKNOWN = 253, 254, 255
BUCKETS = 64  # more than the dearest step of any toll
FAR = 2**31 - 1  # the distance of a cell that the search has not met


@lean("b1(i2[::1], u1[::1], i8, i8)")
def same(values, costs, free, occupied):
    """Whether a row of cells is free, occupied and unknown where its costs say so. Without a
    branch, so that it takes a fraction of the time of looking at each."""
    differing, low, high = np.int32(0), np.int16(free), np.int16(occupied)
    for k in range(len(values)):
        differing += ((values[k] <= low) != (costs[k] <= np.uint8(INSCRIBED))) \
            | ((values[k] >= high) != (costs[k] == np.uint8(LETHAL)))
    return differing == 0


@lean("i8(i2[:,::1], i8[::1], i8, i8, i8, i8, i8, u1[:,::1], i8[:,::1])")
def classify(fused, tile_version, seen, tiles_x, free, occupied, reach, cost, boxes):
    """Bring cells of tiles newer than ``seen`` up to date, free ones with cost 0 for now.

    fused [tiles, 1024] log-odds, known free at or below ``free`` and occupied at or above
    ``occupied`` | boxes [tiles, 4], out: row, row end, column, column end around the cells whose
    cost is to be found anew: those that changed, and all within ``reach`` of a changed obstacle.
    Returns the number of boxes.
    """
    rows, columns, count = cost.shape[0] - 2, cost.shape[1] - 2, 0
    for tile in range(len(tile_version)):
        if tile_version[tile] <= seen:
            continue
        row0, column0 = tile // tiles_x * TILE + 1, tile % tiles_x * TILE + 1
        low_row, end_row, low_column, end_column = rows + 1, 0, columns + 1, 0
        width = min(TILE, columns + 1 - column0)
        for r in range(row0, min(row0 + TILE, rows + 1)):
            values = fused[tile, (r - row0) * TILE:(r - row0) * TILE + width]
            costs = cost[r, column0:column0 + width]
            if same(values, costs, free, occupied):
                continue
            for c in range(width):
                value, old = values[c], costs[c]
                new = 0 if value <= free else LETHAL if value >= occupied else UNKNOWN
                if new == old or (new == 0 and old <= INSCRIBED):
                    continue
                costs[c] = new
                rim, column = reach if new == LETHAL or old == LETHAL else 0, column0 + c
                low_row, end_row = min(low_row, r - rim), max(end_row, r + rim + 1)
                low_column, end_column = min(low_column, column - rim), max(end_column,
                                                                            column + rim + 1)
        if end_row > 0:
            boxes[count, 0], boxes[count, 1] = max(low_row, 1), min(end_row, rows + 1)
            boxes[count, 2], boxes[count, 3] = max(low_column, 1), min(end_column, columns + 1)
            count += 1
    return count


@lean("void(i8[:,::1], i8, i8[:,::1], i8, u1[:,::1])")
def inflate(boxes, count, stencil, reach, cost):
    """The cost of the free cells in ``boxes``: the highest that an obstacle near by gives.

    stencil [k, 3] row offset, column offset, cost <= INSCRIBED | reach: its half width in cells
    """
    for b in range(count):
        row, end_row, column, end_column = boxes[b]
        for r in range(row, end_row):
            line = cost[r, column:end_column]
            for c in range(len(line)):  # without a branch: vector instructions
                line[c] = line[c] if line[c] > np.uint8(INSCRIBED) else np.uint8(0)
        left, right = max(column - reach, 1), min(end_column + reach, cost.shape[1] - 1)
        for r in range(max(row - reach, 1), min(end_row + reach, cost.shape[0] - 1)):
            line = cost[r, left:right]
            for c in range(len(line)):
                if line[c] != LETHAL:
                    continue
                for k in range(len(stencil)):
                    y, x = r + stencil[k, 0], left + c + stencil[k, 1]
                    if row <= y < end_row and column <= x < end_column \
                            and cost[y, x] < stencil[k, 2]:
                        cost[y, x] = stencil[k, 2]


@njit("b1(u1[::1], i8, i8)", cache=True, inline="always")
def beside_unknown(flat, across, cell):
    """Whether one of the four neighbours is unknown."""
    return (flat[cell - 1] == UNKNOWN or flat[cell + 1] == UNKNOWN
            or flat[cell - across] == UNKNOWN or flat[cell + across] == UNKNOWN)


@lean("b1(u1[::1], i8, i4[:,::1], i8, i8[:,::1])")
def is_frontier(flat, across, toll, cell, discs):
    """Passable, with an unknown neighbour at one of its four sides, and in none of ``discs``
    [k, 3] row, column, squared radius in cells."""
    if toll[0, flat[cell]] == 0 or not beside_unknown(flat, across, cell):
        return False
    row, column = cell // across, cell % across
    for k in range(len(discs)):
        if (row - discs[k, 0])**2 + (column - discs[k, 1])**2 <= discs[k, 2]:
            return False
    return True


@lean("i8(u1[::1], i8, i4[:,::1], i8, i8[:,::1], u1[::1], i4[::1])")
def cluster(flat, across, toll, seed, discs, seen, queue):
    """The frontier cells that hang together (8 neighbours) with ``seed``: written to ``queue`` in
    the order of their number of steps from it, marked in ``seen``. Returns how many."""
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


@njit("UniTuple(i8, 2)(u1[::1], i8, i4[:,::1], i8, i8, i8, i8, i8, i8[:,::1], i4[::1], u1[::1], "
      "i4[::1], i4[:,::1], i8[::1], i8[:,::1])", cache=True)
def spread(flat, across, toll, start, goal, limit, smallest, inward, discs, distance, seen, queue,
           buckets, used, found):
    """Dijkstra from ``start`` with integer costs in circular buckets (Dial 1969), in order of cost
    until ``goal`` is settled, or ``limit`` frontier clusters, or all there is.

    toll [2, 256] cost of a step (straight, diagonal) into a cell by its cost, 0 = impassable |
    goal: -1 for none | limit: 0 = no frontiers wanted | smallest: cells of a cluster that counts |
    inward: a cluster is aimed at so many cells from the one met first, at most half way |
    distance [cells], out: settled cells have theirs | seen, queue [cells] and buckets
    [BUCKETS, cells]: room to work in | used [2], in and out: where the last search wrote to
    distance and seen, from and to | found [>= limit, 2], out: cell aimed at, cells of cluster
    Returns the number of clusters found, and the cost up to which all is settled.
    """
    distance[used[0]:used[1]] = FAR
    seen[used[0]:used[1]] = 0
    used[0], used[1] = start, start + 1
    filled = np.zeros(BUCKETS, np.int64)
    straight, diagonal, least = toll[0], toll[1], toll[0, 0]
    around = np.array([-across, -1, 1, across, -across - 1, 1 - across, across - 1, across + 1])
    distance[start], buckets[0, 0], filled[0] = 0, start, 1
    waiting, far, count, open_ = 1, 0, 0, 0
    while waiting > 0:
        b = far % BUCKETS
        for k in range(filled[b]):  # no step is free, so nothing joins this bucket meanwhile
            cell = buckets[b, k]
            if distance[cell] != far:
                continue
            if count < limit and beside_unknown(flat, across, cell) and seen[cell] == 0 \
                    and is_frontier(flat, across, toll, cell, discs):
                size = cluster(flat, across, toll, cell, discs, seen, queue)
                used[0] = min(used[0], queue[:size].min())
                used[1] = max(used[1], queue[:size].max() + 1)
                if size >= smallest:
                    aim = queue[min(inward, size // 2)]
                    found[count, 0], found[count, 1] = aim, size
                    count += 1
                    if aim == cell or distance[aim] > far:  # else it is settled already
                        seen[aim] = 2
                        open_ += 1
            if seen[cell] == 2:
                open_ -= 1
            if cell == goal or (limit > 0 and count == limit and open_ == 0):
                return count, far
            used[0], used[1] = min(used[0], cell - across - 1), max(used[1], cell + across + 2)
            for n in range(8):
                near = np.uint64(cell + around[n])  # unsigned: numba then needs no test for < 0
                if distance[near] <= far + least:
                    continue
                step = straight[flat[near]] if n < 4 else diagonal[flat[near]]
                if step > 0 and far + step < distance[near]:
                    distance[near] = far + step
                    target = (far + step) % BUCKETS
                    buckets[target, filled[target]] = near
                    filled[target] += 1
                    waiting += 1
        waiting -= filled[b]
        filled[b] = 0
        far += 1
    return count, FAR - 1


@lean("i8(u1[::1], i8, i4[:,::1], i4[::1], i8, i4[::1])")
def trace_back(flat, across, toll, distance, goal, way):
    """The cells of a cheapest way from the start of the last ``spread`` to the settled ``goal``,
    written to ``way``, goal first. Returns how many."""
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


@lean("i8(u1[::1], i8, i8, i8)")
def dearest(flat, across, a, b):
    """The highest cost on the straight line between the centres of two cells, sampled at half
    cells, without the cell ``a`` itself."""
    row, column = a // across, a % across
    rows, columns = b // across - row, b % across - column
    steps, highest = 2 * max(abs(rows), abs(columns)), 0
    for k in range(2, steps + 1):
        r = row + int(np.floor(k * rows / steps + 0.5))
        c = column + int(np.floor(k * columns / steps + 0.5))
        highest = max(highest, flat[r * across + c])
    return highest


@lean("i8(u1[::1], i8, i4[::1], i8, i8, f8, f8, f8, f8[:,::1])")
def straighten(flat, across, way, count, longest, cell_m, x_m, y_m, points):
    """Way points of ``way`` (goal first) from the start on: each the farthest cell, up to
    ``longest`` cells ahead, that a straight line reaches without meeting a higher cost than the
    way does. ``points`` [k, 2], out: x, y in m. Returns how many."""
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
            if dearest(flat, across, way[anchor], way[k]) <= allowed:
                best = k
        anchor = best


@lean("i8(u1[::1], i8, i8, i8)")
def nearest_free(flat, across, cell, reach):
    """The cell of a cost below INSCRIBED nearest to ``cell``, at most ``reach`` cells away; of
    equally near ones the cheapest, then the first; -1 if there is none."""
    rows, row, column = len(flat) // across, cell // across, cell % across
    best, near2, lowest = -1, reach * reach + 1, 0
    for r in range(max(row - reach, 1), min(row + reach, rows - 2) + 1):
        for c in range(max(column - reach, 1), min(column + reach, across - 2) + 1):
            cost, d2 = flat[r * across + c], (r - row)**2 + (c - column)**2
            if cost < INSCRIBED and (d2 < near2 or (d2 == near2 and best >= 0 and cost < lowest)):
                best, near2, lowest = r * across + c, d2, cost
    return best


@lean("i8(u1[::1], i8, i8, i8, i8)")
def frontier_cells(flat, across, cell, reach, highest):
    """Cells of a cost up to ``highest`` with an unknown neighbour (4) in the square of ``reach``
    cells around ``cell``."""
    rows, row, column, count = len(flat) // across, cell // across, cell % across, 0
    for r in range(max(row - reach, 1), min(row + reach, rows - 2) + 1):
        for c in range(max(column - reach, 1), min(column + reach, across - 2) + 1):
            k = r * across + c
            if flat[k] <= highest and beside_unknown(flat, across, k):
                count += 1
    return count
