"""Plans: as cheap as Dijkstra's over a graph, straight where they can be, the same from a cache."""

import numpy as np
from drawn import Drawn, costmap, drawn
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from desim.robot.mapping.tiles import FREE, OCCUPIED
from desim.robot.navigation.global_costmap import INSCRIBED
from desim.robot.navigation.global_planner import _WALKING, GlobalPlanner
from desim.robot.navigation.kernels import global_planner as kernels


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


def whole_search(planner, start, goals):
    """Lengths as of a search that goes on to the end of the map."""
    planner._spread(_WALKING, start, np.zeros(0, np.int64), 0, 0, np.zeros((0, 3), np.int64))
    assert planner._arrays.last[3] == kernels.FAR - 1
    costs = planner._arrays.search.distance[goals].astype(float)
    return np.where(costs < kernels.FAR, costs / 5 * planner.costmap.spec.resolution_m, np.inf)


@given(maps(), st.randoms(use_true_random=False))
def test_lengths_are_those_of_the_whole_search(robot_map, random):
    made = costmap(robot_map)
    free = np.flatnonzero(made.flat < INSCRIBED).tolist()
    if not free:
        return
    planner = GlobalPlanner(made)
    for _ in range(4):  # each begins where the last one has left the arrays
        start, goals = random.choice(free), random.choices(free, k=random.randint(1, 6))
        found = [planner.lengths_m(made.centre(start), list(map(made.centre, asked)), 0.0)
                 for asked in (goals[:1], goals, goals[::-1])]  # the last are known already
        frontiers = planner.frontiers(made.centre(start), 2, 1)
        whole = whole_search(planner, start, goals)
        assert np.array_equal(found[0], whole[:1]) and np.array_equal(found[1], whole)
        assert np.array_equal(found[2], whole[::-1])
        planner._arrays.last = None
        assert frontiers == planner.frontiers(made.centre(start), 2, 1)


@given(maps(), st.randoms(use_true_random=False))
def test_a_plan_after_lengths_is_the_plan_of_a_fresh_search(robot_map, random):
    made = costmap(robot_map)
    free = np.flatnonzero(made.flat < INSCRIBED).tolist()
    if not free:
        return
    start, near, far = (made.centre(random.choice(free)) for _ in range(3))
    planner = GlobalPlanner(made)
    planner.lengths_m(start, [near], 0.0)
    cached = planner.plan(start, far, 0.0)
    lengths_m = planner.lengths_m(start, [far, near], 0.0)  # on from a search for a path
    planner._arrays.last = None
    fresh = planner.plan(start, far, 0.0)
    assert (cached is None) == (fresh is None) == bool(np.isinf(lengths_m[0]))
    if fresh is not None:
        assert np.array_equal(cached, fresh)


def test_a_search_for_lengths_ends_with_the_last_of_its_goals():
    made = costmap(Drawn(np.full((40, 200), FREE, np.int16)))
    planner = GlobalPlanner(made)
    places = [(1.5, 4.0), (3.0, 4.0), (1.5, 4.0), (1.0, 4.0)]
    found = planner.lengths_m((1.0, 4.0), places, 0.0)
    assert found.tolist() == [0.4 if x_m == 1.5 else x_m - 1.0 for x_m, _ in places]
    distance = planner._arrays.search.distance
    assert distance[made.cell(39.0, 4.0)] == kernels.FAR
    assert planner._arrays.last[3] == distance[made.cell(3.0, 4.0)]
    assert planner.lengths_m((1.0, 4.0), [], 0.2).shape == (0,)


def test_a_goal_that_cannot_be_reached_ends_no_search():
    corridor = np.zeros((20, 60), np.int16)
    corridor[10, :40] = corridor[10, 45:] = FREE
    planner = GlobalPlanner(costmap(Drawn(corridor)))
    places = [(11.0, 2.1), (4.0, 2.1)]
    found = planner.lengths_m((1.0, 2.1), places, 0.0)
    assert np.isinf(found[0]) and found[1] == 3.0
    assert planner._arrays.last[3] == kernels.FAR - 1
    assert planner.lengths_m((1.0, 2.1), places[1:], 0.0).tolist() == [3.0]


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
