"""Plans: as cheap as Dijkstra's over a graph, straight where they can be, the same from a cache."""

import numpy as np
from drawn import Drawn, costmap, drawn
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from desim.robot.navigation.global_costmap import INSCRIBED
from desim.robot.navigation.global_planner import _WALKING, GlobalPlanner
from desim.robot.navigation.kernels import global_planner as kernels
from desim.robot.tiles import FREE, OCCUPIED


def graph_distances(made, start):
    """Cost of the cheapest way to every cell, by scipy over an explicit graph."""
    across, flat = made.across, made.flat
    entries = [(a, b, int(_WALKING[abs(dr * dc), flat[b]]))
               for a in range(across + 1, len(flat) - across - 1)
               for dr in (-1, 0, 1) for dc in (-1, 0, 1)
               if (b := a + dr * across + dc) != a and flat[a] < INSCRIBED and flat[b] < INSCRIBED]
    rows, columns, tolls = np.array(entries).reshape(-1, 3).T
    graph = csr_array((tolls, (rows, columns)), shape=(len(flat), len(flat)))
    return dijkstra(graph, indices=start)


@st.composite
def maps(draw):
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    share = draw(st.sampled_from([0.02, 0.05, 0.1]))
    return Drawn(rng.choice(np.array([FREE, OCCUPIED, 0], np.int16), (24, 36),
                            p=[0.95 - share, share, 0.05]))


@given(maps(), st.randoms(use_true_random=False))
def test_the_search_finds_the_cheapest_ways(robot_map, random):
    made = costmap(robot_map)
    free = np.flatnonzero(made.flat < INSCRIBED).tolist()
    if not free:
        return
    start = random.choice(free)
    expected = graph_distances(made, start)
    planner = GlobalPlanner(made)
    for goal in random.sample(free, min(5, len(free))):
        way = planner.plan(made.centre(start), made.centre(goal), 0.0)
        if np.isinf(expected[goal]):
            assert way is None
            continue
        assert planner._arrays.search.distance[goal] == expected[goal]
        assert tuple(way[0]) == made.centre(start)
        assert tuple(way[-1]) == made.centre(goal)


@given(maps(), st.randoms(use_true_random=False))
def test_straight_legs_stay_clear(robot_map, random):
    made = costmap(robot_map)
    free = np.flatnonzero(made.flat < INSCRIBED).tolist()
    if len(free) < 2:
        return
    start, goal = random.sample(free, 2)
    way = GlobalPlanner(made).plan(made.centre(start), made.centre(goal), 0.0)
    if way is None:
        return
    for a, b in zip(way[:-1], way[1:], strict=True):
        assert made.clear_line(tuple(a), tuple(b))


def test_an_open_floor_is_crossed_in_one_leg():
    robot_map = Drawn(np.full((30, 30), FREE, np.int16))
    way = GlobalPlanner(costmap(robot_map)).plan((0.5, 0.5), (4.9, 2.9), 0.0)
    assert way.round(6).tolist() == [[0.5, 0.5], [4.9, 2.9]]


def test_a_way_keeps_its_distance_from_a_corner():
    # 3 m x 3 m with a wall from the left up to the middle
    lines = ["." * 15] * 7 + ["#" * 8 + "." * 7] + ["." * 15] * 7
    made = costmap(drawn(*lines))
    way = GlobalPlanner(made).plan((0.3, 0.3), (0.3, 2.7), 0.0)
    row, column = divmod(np.array([made.cell(x, y) for x, y in way]), made.across)
    assert (made.values[row, column] == 0).all()  # no way point within 0.55 m of the wall
    assert way[:, 0].max() >= 1.6 + 0.5


def test_no_way_and_no_free_goal():
    made = costmap(drawn("....#....", "....#....", "....#...."))
    planner = GlobalPlanner(made)
    assert planner.plan((0.1, 0.3), (1.7, 0.3), 0.4) is None
    assert planner.plan((0.1, 0.3), (0.9, 0.3), 0.2) is None  # in the wall
    assert planner.plan((0.1, 0.3), (0.9, 0.3), 0.6).shape[1] == 2  # beside it


@given(maps(), st.randoms(use_true_random=False))
def test_a_plan_after_looking_for_frontiers_is_the_plan_of_a_fresh_search(robot_map, random):
    made = costmap(robot_map)
    free = np.flatnonzero(made.flat < INSCRIBED).tolist()
    if not free:
        return
    start = made.centre(random.choice(free))
    planner = GlobalPlanner(made)
    for frontier in planner.frontiers(start, 1, 2):
        cached = planner.plan(start, (frontier.x_m, frontier.y_m), 0.0)
        planner._arrays.last = None
        fresh = planner.plan(start, (frontier.x_m, frontier.y_m), 0.0)
        assert np.array_equal(cached, fresh)


def test_another_robots_search_in_between_changes_nothing():
    here = Drawn(np.full((20, 20), FREE, np.int16))
    wall = np.full((20, 20), FREE, np.int16)
    wall[10, :15] = OCCUPIED
    one, other = GlobalPlanner(costmap(here)), GlobalPlanner(costmap(Drawn(wall)))
    assert len(one.plan((1.0, 1.0), (1.0, 3.5), 0.0)) == 2
    assert len(other.plan((1.0, 1.0), (1.0, 3.5), 0.0)) > 2
    assert len(one.plan((1.0, 1.0), (1.0, 3.5), 0.0)) == 2


def test_a_search_that_ends_where_it_begins_leaves_nothing_behind():
    corridor = np.zeros((20, 20), np.int16)
    corridor[10] = FREE
    planner = GlobalPlanner(costmap(Drawn(corridor)))
    fresh = planner.plan((0.3, 2.1), (3.7, 2.1), 0.0)
    planner._arrays.last = None
    assert len(planner.plan((2.1, 2.1), (2.1, 2.1), 0.0)) == 1
    planner._arrays.last = None
    assert np.array_equal(planner.plan((0.3, 2.1), (3.7, 2.1), 0.0), fresh)


def test_tolls_fit_the_buckets():
    assert _WALKING[_WALKING > 0].min() > 0
    assert _WALKING.max() < kernels.BUCKETS
