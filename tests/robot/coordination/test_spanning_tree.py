"""The tour around a spanning tree: every cell once, and back, on any ground."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from scipy import ndimage

from desim.robot.coordination import spanning_tree
from desim.robot.coordination.spanning_tree import closed_tour
from desim.robot.coordination.sweep_tour import cyclic_runs, with_detours

BLOCKS = arrays.arrays(bool, st.tuples(st.integers(1, 7), st.integers(1, 7)))


def is_tour(blocks):
    """Whether it passes each cell of the largest part once, from neighbour to neighbour."""
    tour = closed_tour(blocks)
    parts, count = ndimage.label(blocks)
    if not count:
        return tour == []
    size = np.bincount(parts.ravel())[1:].max()
    steps = np.abs(np.diff([*tour, tour[0]], axis=0)).sum(axis=1)
    return (len(tour) == len(set(tour)) == 4 * size and bool((steps == 1).all())
            and len({int(parts[row // 2, column // 2]) for row, column in tour}) == 1
            and all(blocks[row // 2, column // 2] for row, column in tour))


@given(BLOCKS)
def test_every_cell_once(blocks):
    assert is_tour(blocks)


def test_a_tour_that_ignores_the_tree_is_none(monkeypatch):
    """Twin: without edges the way never leaves its block."""
    blocks = np.ones((2, 3), bool)
    assert is_tour(blocks)
    monkeypatch.setattr(spanning_tree, "spanning_tree", lambda blocks: set())
    assert not is_tour(blocks)


@given(BLOCKS, st.data())
def test_detours_leave_no_cell_out(blocks, data):
    cells = np.kron(blocks, np.ones((2, 2), bool))
    cells |= data.draw(arrays.arrays(bool, cells.shape))
    order = closed_tour(blocks)
    if order:
        found = with_detours(order, cells)
        assert sorted(found) == [tuple(cell) for cell in np.argwhere(cells).tolist()]
        assert [cell for cell in found if cell in set(order)] == order


@given(arrays.arrays(bool, st.integers(0, 12)))
def test_runs_around_the_end(flags):
    runs = cyclic_runs(flags)
    again = np.zeros(len(flags), bool)
    for begin, length in runs:
        again[(begin + np.arange(length)) % len(flags)] = True
    assert (again == flags).all()
    assert sum(length for _, length in runs) == flags.sum()
