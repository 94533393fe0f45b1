"""The tour on which a tool passes over the free ground of a robot's map, cell by cell."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from desim import ports
from desim.robot.coordination.spanning_tree import closed_tour

_FREE = 252  # the largest cost where a robot's centre can be (costmap_2d)


def sweep_tour(robot: ports.StrategyContext) -> tuple[list[ports.Place], np.ndarray]:
    """The centres of the cells of the tool's width to which paths lead, in the order of the tour
    around a spanning tree, and of each whether it is away from walls, bool [n]."""
    width_m, grid, costs = robot.task.width_m, robot.grid, robot.costmap()
    rows, columns = (max(2, int(cells * grid.resolution_m / width_m) // 2 * 2)
                     for cells in (grid.height, grid.width))
    x_m, y_m = (origin_m + (np.arange(count) + 0.5) * width_m
                for origin_m, count in ((grid.x_m, columns), (grid.y_m, rows)))
    at = (((y_m - grid.y_m) / grid.resolution_m).astype(int)[:, None].clip(0, grid.height - 1),
          ((x_m - grid.x_m) / grid.resolution_m).astype(int)[None].clip(0, grid.width - 1))
    cells = costs[at] <= _FREE
    places = [(float(x_m[column]), float(y_m[row])) for row, column in np.argwhere(cells)]
    cells[cells] = np.isfinite(robot.path_lengths_m(places))
    order = closed_tour(cells.reshape(rows // 2, 2, columns // 2, 2).all(axis=(1, 3)))
    if not order:
        order = [(row, column) for row, column in np.argwhere(cells).tolist()]
    order = with_detours(order, cells)
    tour = [ports.Place(float(x_m[column]), float(y_m[row])) for row, column in order]
    return tour, np.array([costs[at][cell] == 0 for cell in order], bool)


def straight_on(first: int, tour: Sequence[ports.Place], free: np.ndarray,
                theirs: Collection[int]) -> list[int]:
    """The cells of ``tour`` from ``first`` on that are on one straight line, ``free``, bool [n],
    and before those that are ``theirs``."""
    way, places_m = [first], np.array(tour)
    while True:
        on = (way[-1] + 1) % len(tour)
        step = places_m[on] - places_m[way[-1]]
        before = places_m[way[1]] - places_m[way[0]] if len(way) > 1 else step
        if not free[on] or on in theirs or on in way or np.abs(step - before).max() > 1e-6:
            return way
        way.append(on)


def with_detours(order: list[tuple[int, int]], cells: np.ndarray) -> list[tuple[int, int]]:
    """The tour with all other ``cells``, bool [rows, columns], each behind the cell of ``order``
    that is nearest to it, the nearest first."""
    on_tour, at = set(order), np.array(order)
    detours: dict[int, list[tuple[float, tuple[int, int]]]] = {}
    for row, column in np.argwhere(cells).tolist():
        if (row, column) not in on_tour:
            away = np.hypot(*(at - (row, column)).T)
            detours.setdefault(int(away.argmin()), []).append((float(away.min()), (row, column)))
    return [cell for i, own in enumerate(order)
            for cell in (own, *(other for _, other in sorted(detours.get(i, ()))))]


def cyclic_runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """Begin and length of each run of true ``flags`` [n], where the last is before the first."""
    if flags.all():
        return [(0, len(flags))] if len(flags) else []
    begins = np.flatnonzero(flags & ~np.roll(flags, 1))
    ends = np.flatnonzero(flags & ~np.roll(flags, -1))
    return [(int(begin), int(min((ends - begin) % len(flags))) + 1) for begin in begins]
