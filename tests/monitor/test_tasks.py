"""Tasks on a made-up fleet: the idleness of places by hand, and when a task is done."""

import numpy as np
import pytest

from desim.errors import InputError
from desim.monitor.places import drawn, free_cells
from desim.monitor.tasks.exploration import Exploration
from desim.monitor.tasks.patrolling import Patrolling
from desim.ports import GridSpec, Place
from desim.ports.tasks import Ground, Patrol
from desim.testing import TaskBench

S = 1_000_000_000
TWO = (("4 m", "4 m"), ("20 m", "4 m"))  # robot_1 of the bench starts at the first


def patrol(**params):
    return TaskBench(Patrolling(Patrolling.Params(places=TWO, **params)))


def test_idleness_of_two_places_by_hand():
    """robot_1 is at A until 10 s, at B from 20 s to 30 s, and away until 40 s."""
    bench = patrol()
    for until_s, x_m in ((10, 4.0), (20, 12.0), (30, 20.0), (40, 12.0)):
        bench.move(0, x_m, 4.0)
        bench.run(until_s * S)
    metrics = bench.task.metrics()
    # A was idle for 30 s at the end, B for 20.1 s (the first look at it) and again for 10 s:
    # its last look was at 30 s. Before the first look A was for 0.1 s. The integral of what grows
    # as time does is t^2 / 2.
    area_s2 = (0.1**2 + 30.0**2 + 20.1**2 + 10.0**2) / 2
    assert metrics["idleness_mean_s"] == pytest.approx(area_s2 / 2 / 40.0, rel=1e-12)
    assert metrics["idleness_worst_s"] == 30.0
    assert bench.task.measure() == {"idleness_s": 20.0, "idleness_worst_s": 30.0, "visits": 2}
    # The intervals that a visit ended: 0.1 s for A, 20.1 s for B.
    assert metrics["interval_mean_s"] == pytest.approx((0.1 + 20.1) / 2)
    assert (metrics["visits_by_place"], metrics["visits_by_robot"]) == ([1, 1], [2, 0])
    assert bench.rows == [(S // 10, "visit", "robot_1", 0, S // 10),
                          (20 * S + S // 10, "visit", "robot_1", 1, 20 * S + S // 10)]


@pytest.mark.parametrize("period_s", [10, 40])
def test_a_lone_robot_on_a_cycle(period_s):
    """With a visit every T seconds idleness is a saw tooth: mean T/2, worst T, interval T."""
    bench = patrol(within="0.5 m")
    for k in range(400 // period_s):
        for robot, x_m in ((0, 4.0), (2, 20.0)):  # each at its place in the first tenth of T
            bench.move(robot, x_m, 4.0)
        bench.run(k * period_s * S + S // 10)
        for robot in (0, 2):
            bench.move(robot, 30.0, 30.0)
        bench.run((k + 1) * period_s * S)
    metrics = bench.task.metrics()
    assert metrics["idleness_mean_s"] == pytest.approx(period_s / 2, abs=0.1)
    assert metrics["idleness_worst_s"] == pytest.approx(period_s)
    visits = 400 // period_s  # the first one ended an interval of 0.1 s
    assert metrics["interval_mean_s"] == pytest.approx(
        ((visits - 1) * period_s + 0.1) / visits)
    assert metrics["visits_by_robot"] == [visits, visits]


def test_who_carries_no_software_visits_nothing():
    bench = patrol()
    bench.move(0, 30.0, 30.0)
    bench.move(1, 4.0, 4.0)  # robot_2
    bench.run(10 * S)
    assert bench.task.metrics()["visits"] == 0


def test_a_patrol_is_done_after_its_rounds():
    bench = patrol(rounds=2)
    for k in range(4):
        bench.move(0, 4.0 if k % 2 == 0 else 20.0, 4.0)
        bench.run((k + 1) * 5 * S)
        assert (bench.reason is None) == (k < 3), k
    assert bench.reason == "patrolled"
    assert bench.rows[-1][0] == 15 * S + S // 10


def test_the_briefing_has_the_places_that_were_given_or_drawn():
    assert patrol().task.briefing() == Patrol((Place(4.0, 4.0), Place(20.0, 4.0)))
    places = TaskBench(Patrolling(Patrolling.Params(drawn=6))).task.briefing().places
    assert len(set(places)) == 6
    assert all(1.3 <= at <= 30.7 for place in places for at in place)  # 0.8 m from walls, of 0.5 m


@pytest.mark.parametrize("params, text", [
    ({"places": (("4 m", "4 m"), ("0.1 m", "4 m"))},
     ".places.1: 0.1 m, 4 m is inside a wall"),
    ({"places": (("4 m", "4 m"), ("5 m", "4 m"), ("4 m", "400 cm"))},
     ".places.2: 4 m, 4 m is places.0 already; allowed: each place once"),
    ({"places": (("400 m", "4 m"),)}, ".places.0: 400 m, 4 m is outside the terrain"),
    ({"clearance": "20 m"}, ".drawn: there are 0 places with this clearance, not 8"),
])
def test_places_that_cannot_be(params, text):
    with pytest.raises(InputError) as caught:
        TaskBench(Patrolling(Patrolling.Params(**params)))
    assert str(caught.value) == text


def test_places_are_drawn_where_robots_can_get():
    """Two halls with a gap of 1 m between them: with 0.8 m of clearance nobody passes it."""
    solid = np.zeros((40, 40), np.uint8)
    solid[[0, -1]] = solid[:, [0, -1]] = solid[:, 20] = 1
    solid[10:12, 20] = 0
    ground = Ground(GridSpec(0.5, 40, 40, 0.0, 0.0), solid, solid == 0)
    start = np.array([[0.7, 5.0]])  # nearer to a wall than places may be
    near = free_cells(ground, start, 0.8)
    assert near[:, 0].max() < 10.0 < free_cells(ground, start, 0.25)[:, 0].max()
    with pytest.raises(InputError):
        drawn(near, len(near) + 1, np.random.default_rng(0))


def test_drawn_places_are_farther_apart_than_random_ones():
    cells = np.stack(np.meshgrid(np.arange(30.0), np.arange(30.0)), -1).reshape(-1, 2)

    def nearest_m(places):
        apart = np.hypot(*(np.array(places)[:, None] - np.array(places)).T)
        return (apart + 1e9 * np.eye(len(apart))).min()

    spread = [nearest_m(drawn(cells, 12, np.random.default_rng(k))) for k in range(20)]
    random = [nearest_m(cells[np.random.default_rng(k).integers(900, size=12)]) for k in range(20)]
    assert np.mean(spread) > 2 * np.mean(random)


@pytest.mark.parametrize("by, end_row", [("any", 63), ("union", 63), ("all", None),
                                         ("none", None)])
def test_exploration_is_done_when_stop_says_so(by, end_row):
    bench = TaskBench(Exploration(Exploration.Params()))
    bench.stop_by = by
    for row in range(1, 65):
        bench.run(row * S)
        bench.learn(0, row)
        if bench.reason:
            break
    assert (row if bench.reason else None) == end_row  # 62 x 62 free cells, of which 99 %
    metrics = bench.task.metrics()
    assert metrics["exploration_time_s"] == metrics["union_time_s"] == 63.0
    assert (metrics["fleet_time_s"], metrics["censored"]) == (None, False)
    assert bench.task.judged() == 0
