"""Mazes by recursive backtracking, with some loops."""

from __future__ import annotations

import numpy as np

from desim.scenario.schema.environment import Shape
from desim.scenario.schema.generated import Maze
from desim.world.generated.walls import length, wall

Cell = tuple[int, int]  # column, row


def shape(plan: Maze, rng: np.random.Generator) -> Shape:
    """The maze: whole cells at least as large as wanted, a wall between any two that are not
    joined."""
    width, depth = plan.size_m
    cols, rows = plan.cells
    joined = _spanning_tree(cols, rows, rng)
    _braid(joined, plan.loops, rng)
    x_m, y_m = width / cols, depth / rows
    walls = []
    for (col, row), open_to in joined.items():
        x, y = (col + 1) * x_m - width / 2, (row + 1) * y_m - depth / 2
        if col + 1 < cols and (col + 1, row) not in open_to:
            walls.append(wall(plan, (x, y - y_m), (x, y)))
        if row + 1 < rows and (col, row + 1) not in open_to:
            walls.append(wall(plan, (x - x_m, y), (x, y)))
    return Shape(size=(length(width), length(depth)), walls=tuple(walls))


def _spanning_tree(cols: int, rows: int, rng: np.random.Generator) -> dict[Cell, list[Cell]]:
    """The cells that each cell is joined with: recursive backtracking, with a list in the place of
    the recursion (Buck 2015)."""
    joined: dict[Cell, list[Cell]] = {(col, row): [] for row in range(rows) for col in range(cols)}
    here = (int(rng.integers(cols)), int(rng.integers(rows)))
    way, seen = [here], {here}
    while way:
        fresh = [cell for cell in _around(way[-1]) if cell in joined and cell not in seen]
        if not fresh:
            way.pop()
            continue
        there = fresh[int(rng.integers(len(fresh)))]
        joined[way[-1]].append(there)
        joined[there].append(way[-1])
        seen.add(there)
        way.append(there)
    return joined


def _braid(joined: dict[Cell, list[Cell]], share: float, rng: np.random.Generator) -> None:
    """Open a wall of each dead end with the probability ``share``."""
    for here, open_to in joined.items():
        if len(open_to) != 1 or rng.random() >= share:
            continue
        closed = [cell for cell in _around(here) if cell in joined and cell not in open_to]
        if closed:
            there = closed[int(rng.integers(len(closed)))]
            open_to.append(there)
            joined[there].append(here)


def _around(cell: Cell) -> list[Cell]:
    col, row = cell
    return [(col + 1, row), (col, row + 1), (col - 1, row), (col, row - 1)]
