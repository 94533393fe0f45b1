"""A closed tour around a spanning tree passes every cell once (Gabriely and Rimon 2001)."""

from __future__ import annotations

import numpy as np

_EAST, _NORTH, _WEST, _SOUTH = (0, 1), (1, 0), (0, -1), (-1, 0)  # row, column
# Counterclockwise around the tree, which is on the left: at this quarter (row, column) of a block,
# the way on within the block, and the edge of the tree that leads to the next block instead.
_WAYS = {(0, 0): (_EAST, _SOUTH), (0, 1): (_NORTH, _EAST), (1, 1): (_WEST, _NORTH),
         (1, 0): (_SOUTH, _WEST)}


def spanning_tree(blocks: np.ndarray) -> set[tuple[tuple[int, int], tuple[int, int]]]:
    """The edges, in both directions, of a tree over the largest connected part of ``blocks``, bool
    [rows, columns]; of equal ones the first. It is built by depth first search, east before north,
    so that its branches are long."""
    from scipy import ndimage  # most runs do without it

    parts, count = ndimage.label(blocks)
    if not count:
        return set()
    largest = 1 + int(np.argmax(np.bincount(parts.ravel())[1:]))
    rows, columns = np.nonzero(parts == largest)
    left = set(zip(rows.tolist(), columns.tolist(), strict=True))
    path, edges = [min(left)], set()
    left.remove(path[0])
    while path:
        row, column = path[-1]
        for step in (_EAST, _NORTH, _WEST, _SOUTH):
            other = row + step[0], column + step[1]
            if other in left:
                left.remove(other)
                edges |= {(path[-1], other), (other, path[-1])}
                path.append(other)
                break
        else:
            path.pop()
    return edges


def closed_tour(blocks: np.ndarray) -> list[tuple[int, int]]:
    """The cells (row, column), four to a block, in the order of the tour around the tree; a single
    block has its four. Empty without a block."""
    edges = spanning_tree(blocks)
    if not blocks.any():
        return []
    start = min(block for edge in edges for block in edge) if edges else \
        tuple(np.argwhere(blocks)[0].tolist())
    cell = first = (2 * start[0], 2 * start[1])
    tour: list[tuple[int, int]] = []
    while not tour or cell != first:
        tour.append(cell)
        block = cell[0] // 2, cell[1] // 2
        way, edge = _WAYS[cell[0] % 2, cell[1] % 2]
        leaves = (block, (block[0] + edge[0], block[1] + edge[1])) in edges
        step = edge if leaves else way
        cell = cell[0] + step[0], cell[1] + step[1]
    return tour
