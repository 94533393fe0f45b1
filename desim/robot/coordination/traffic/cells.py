"""A grid of cells that robots move on, made of a map; and the distances on it."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property

import numpy as np

from desim.ports import GridSpec, Place

Cell = tuple[int, int]  # column, row
_BLOCKED = 253  # costmap_2d: from here on a robot's centre cannot be there


class CellGraph:
    """The cells whose centres robots can be at, each joined to those of its four neighbours to
    which a straight way is free. ``edges``: from each cell; ``centre(cell)``: its place."""

    def __init__(self, edges: Mapping[Cell, tuple[Cell, ...]], cell_m: float = 1.0,
                 origin_m: tuple[float, float] = (0.0, 0.0)) -> None:
        self.edges, self._cell_m, self._origin_m = edges, cell_m, origin_m
        self._ways: dict[Cell, dict[Cell, int]] = {}
        self._nearest: dict[tuple[float, ...], Cell] = {}  # to places that were asked for

    def centre(self, cell: Cell) -> Place:
        """Its middle."""
        return Place(*((index + 0.5) * self._cell_m + origin_m for index, origin_m
                       in zip(cell, self._origin_m, strict=True)))

    @cached_property
    def _centres_m(self) -> tuple[list[Cell], np.ndarray]:
        cells = list(self.edges)
        return cells, np.array([self.centre(cell) for cell in cells]).reshape(-1, 2)

    def nearest(self, place: Sequence[float]) -> Cell:
        """The cell whose centre is nearest to ``place`` [2] m."""
        key = tuple(place)
        if key not in self._nearest:
            self._nearest[key] = self.nearest_but(place, ())
        return self._nearest[key]

    def nearest_but(self, place: Sequence[float], other: Iterable[Cell]) -> Cell:
        """The cell whose centre is nearest to ``place`` [2] m, not one of ``other``."""
        cells, centres_m = self._centres_m
        taken = set(other)
        order = np.argsort(np.hypot(*(centres_m - place[:2]).T), kind="stable")
        return next(cells[k] for k in order.tolist() if cells[k] not in taken)

    def steps_to(self, goal: Cell) -> dict[Cell, int]:
        """The number of steps to ``goal`` from each cell from which there is a way."""
        if goal not in self._ways:
            steps, queue = {goal: 0}, deque([goal])
            while queue:
                cell = queue.popleft()
                for beside in self.edges[cell]:
                    if beside not in steps:
                        steps[beside] = steps[cell] + 1
                        queue.append(beside)
            self._ways[goal] = steps
        return self._ways[goal]


def cells_of(costs: np.ndarray, grid: GridSpec, cell_m: float) -> CellGraph:
    """The graph of a costmap (``StrategyContext.costmap``), in cells of ``cell_m``."""
    free = costs < _BLOCKED
    across = [math.floor(count * grid.resolution_m / cell_m) for count in (grid.width, grid.height)]
    index = [((np.arange(count) + 0.5) * cell_m / grid.resolution_m).astype(int)
             for count in across]
    is_free = free[np.ix_(index[1], index[0])]
    edges: dict[Cell, tuple[Cell, ...]] = {}
    for row, column in zip(*map(np.ndarray.tolist, np.nonzero(is_free)), strict=True):
        beside = []
        for to_column, to_row in ((column + 1, row), (column, row + 1), (column - 1, row),
                                  (column, row - 1)):
            if 0 <= to_column < across[0] and 0 <= to_row < across[1]:
                columns = sorted((index[0][column], index[0][to_column]))
                rows = sorted((index[1][row], index[1][to_row]))
                if free[rows[0]:rows[1] + 1, columns[0]:columns[1] + 1].all():
                    beside.append((to_column, to_row))
        edges[column, row] = tuple(beside)
    return CellGraph(edges, cell_m, (grid.x_m, grid.y_m))
