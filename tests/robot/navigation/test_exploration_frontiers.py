"""Frontiers: those that an exhaustive search finds, in order of the way, and what is left out."""

import numpy as np
from drawn import Drawn, costmap, drawn
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import label
from test_planner import graph_distances

from desim.robot.mapping.tiles import FREE, OCCUPIED
from desim.robot.navigation.global_costmap import INSCRIBED, UNKNOWN
from desim.robot.navigation.global_planner import GlobalPlanner

EIGHT = np.ones((3, 3))


@st.composite
def half_known(draw):
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    cells = np.full((24, 36), FREE, np.int16)
    for value, count in ((0, 6), (OCCUPIED, 4)):
        for _ in range(count):
            row, column = rng.integers(24), rng.integers(36)
            cells[row:row + rng.integers(1, 7), column:column + rng.integers(1, 7)] = value
    return Drawn(cells)


def clusters(made, start, smallest):
    """Sizes of all reachable clusters of frontier cells with the distance to the nearest of each,
    by brute force."""
    values = made.values
    unknown = values == UNKNOWN
    beside = (np.roll(unknown, 1, 0) | np.roll(unknown, -1, 0)
              | np.roll(unknown, 1, 1) | np.roll(unknown, -1, 1))
    distances = graph_distances(made, start).reshape(values.shape)
    labels, count = label((values < INSCRIBED) & beside & np.isfinite(distances), EIGHT)
    found = [(distances[labels == k].min(), int((labels == k).sum())) for k in range(1, count + 1)]
    return sorted(entry for entry in found if entry[1] >= smallest)


@given(half_known(), st.integers(1, 6), st.randoms(use_true_random=False))
def test_frontiers_are_those_of_an_exhaustive_search(robot_map, smallest, random):
    made = costmap(robot_map)
    free = np.flatnonzero(made.flat < INSCRIBED).tolist()
    if not free:
        return
    start = random.choice(free)
    expected = clusters(made, start, smallest)
    planner = GlobalPlanner(made)
    found = planner.frontiers(made.centre(start), None, smallest)
    assert sorted(f.cells for f in found) == sorted(size for _, size in expected)
    assert [f.path_m for f in found] == sorted(f.path_m for f in found)
    for limit in range(1, len(found) + 1):
        met = planner.frontiers(made.centre(start), limit, smallest)
        # Which of equally near ones is met first is the search's own affair.
        allowed = [size for d, size in expected if d <= expected[limit - 1][0]]
        assert len(met) == limit
        assert all(f.cells in allowed for f in met)


def test_the_frontier_that_is_met_first_may_have_the_longer_path():
    """A limit counts in the order of nearest cells; path_m belongs to a cell further in."""
    # The robot is at the lower end of the unknown on its left; on its right there is a spot of it.
    lines = ["?" + "." * 30] * 20 + ["?" + "." * 11 + "?" * 2 + "." * 17] + ["?" + "." * 30] * 3
    planner = GlobalPlanner(costmap(drawn(*lines)))
    every = planner.frontiers((1.1, 0.7), None, 4)
    left, right = sorted(every, key=lambda one: one.x_m)
    assert every == [right, left]  # in the order of path_m
    assert planner.frontiers((1.1, 0.7), 1, 4) == [left]
    assert left.path_m - right.path_m < 2.0


@given(half_known(), st.randoms(use_true_random=False))
def test_the_robot_can_get_to_every_frontier(robot_map, random):
    made = costmap(robot_map)
    free = np.flatnonzero(made.flat < INSCRIBED).tolist()
    if not free:
        return
    start = made.centre(random.choice(free))
    planner = GlobalPlanner(made)
    for frontier in planner.frontiers(start, None, 1):
        assert planner.plan(start, (frontier.x_m, frontier.y_m), 0.0) is not None


def test_a_frontier_is_aimed_at_off_the_end_of_a_wall():
    # The robot is below the wall; what is above it lies in its shadow.
    lines = (["?" * 12 + "." * 18] * 12 + ["#" * 12 + "." * 18] + ["." * 30] * 12)
    made = costmap(drawn(*lines))
    frontier, = GlobalPlanner(made).frontiers((1.0, 1.0), 1, 4)
    assert made.flat[made.cell(frontier.x_m, frontier.y_m)] == 0
    assert frontier.y_m > 12.5 * 0.2 + 0.55


def test_blacklisted_discs_are_left_out():
    lines = ["?" * 20] + ["." * 20] * 10
    made = costmap(drawn(*lines))
    planner = GlobalPlanner(made)
    whole, = planner.frontiers((1.0, 1.0), None, 4)
    assert whole.cells == 20
    row, column = divmod(made.cell(2.0, 1.9), made.across)
    parts = planner.frontiers((1.0, 1.0), None, 4, np.array([[row, column, 9]]))
    assert sorted(f.cells for f in parts) == [6, 7]
    assert planner.frontiers((1.0, 1.0), None, 4, np.array([[row, column, 900]])) == []


def test_slivers_beside_walls_are_among_all_frontiers():
    # Unknown only in the corner, where the robot's centre can never be.
    lines = ["#" * 12] + ["#?" + "." * 10] + ["#" + "." * 11] * 8
    made = costmap(drawn(*lines))
    planner = GlobalPlanner(made)
    assert planner.frontiers((1.5, 0.5), None, 1) == []
    found = planner.all_frontiers((1.5, 0.5), 1)
    assert len(found) == 1
    assert made.flat[made.cell(found[0].x_m, found[0].y_m)] < INSCRIBED
    cell, highest = planner.edge_of(found[0])
    assert made.count_frontier_cells(cell, 2, highest) > 0
    row, column = divmod(made.cell(found[0].x_m, found[0].y_m), made.across)
    assert planner.all_frontiers((1.5, 0.5), 1, np.array([[row, column, 25]])) == []
    assert planner.frontiers((1.5, 0.5), None, 1) == []  # and those before are forgotten
    assert planner.edge_of(found[0]) == (row * made.across + column, INSCRIBED)


def test_a_robot_too_near_to_a_wall_still_finds_its_way_out():
    made = costmap(drawn(*["#" + "." * 9 + "?"] * 5))
    assert made.flat[made.cell(0.25, 0.5)] == INSCRIBED
    assert len(GlobalPlanner(made).frontiers((0.25, 0.5), 1, 1)) == 1


def test_nothing_known_no_frontiers():
    made = costmap(drawn("???", "???"))
    assert GlobalPlanner(made).frontiers((0.3, 0.3), None, 1) == []
    assert GlobalPlanner(made).all_frontiers((0.3, 0.3), None) == []
