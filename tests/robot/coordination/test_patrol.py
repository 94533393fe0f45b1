"""Patrols: which place a robot visits next."""

import math

import numpy as np
import pytest

from desim.ports import Frontier, GoalEnd, Place, StrategyMessage
from desim.ports.tasks import Patrol
from desim.robot.coordination.strategies.conscientious_reactive import ConscientiousReactive
from desim.robot.coordination.strategies.cyclic_patrol import CyclicPatrol, tour
from desim.robot.coordination.strategies.expected_reactive import ExpectedReactive
from desim.testing import StrategyBench

S = 10**9
LINE = tuple(Place(float(x), 0.0) for x in (3, 6, 9, 12, 15, 18))
SQUARE = tuple(Place(float(x), float(y)) for x, y in ((5, 5), (-5, -5), (5, -5), (-5, 5)))
HIDDEN = Frontier(1.0, 1.0, 2.0, 9)


def bench(places, name="robot_1", team=(), unreachable=()):
    made = StrategyBench([HIDDEN], name, team)
    made.task, made.now_ns = Patrol(places), 0
    plain = made.path_lengths_m
    made.path_lengths_m = lambda places, origin=None: np.array([
        math.inf if place in unreachable else length_m
        for place, length_m in zip(places, plain(places, origin).tolist(), strict=True)])
    return made


def visits(strategy, robot, count):
    """The places that it chooses when it reaches each, a second later."""
    chosen = []
    for _ in range(count):
        place = strategy.choose(robot)
        chosen.append(place[0])
        robot.now_ns += S
        robot.pose = robot.pose._replace(x_m=place[0], y_m=place[1])
        strategy.on_goal(robot, Place(*place[:2]), GoalEnd.REACHED)
    return chosen


def test_of_the_nearest_places_the_one_not_visited_for_longest_is_next():
    strategy = ConscientiousReactive(ConscientiousReactive.Params(neighbours=2))
    assert visits(strategy, bench(LINE), 7) == [3, 6, 9, 12, 15, 18, 12]
    greedy = ConscientiousReactive(ConscientiousReactive.Params(neighbours=1))
    assert visits(greedy, bench(LINE), 4) == [3, 6, 3, 6]


@pytest.mark.parametrize("end, counts", [(GoalEnd.REACHED, True), (GoalEnd.FAILED, True),
                                         (GoalEnd.REPLACED, False)])
@pytest.mark.parametrize("kind", [ConscientiousReactive, ExpectedReactive])
def test_a_drive_that_failed_counts_as_a_visit(kind, end, counts):
    strategy, robot = kind(kind.Params()), bench(LINE[:2])
    if kind is ExpectedReactive:
        strategy.on_start(robot)
    strategy.on_goal(robot, LINE[0], end)
    assert (strategy.choose(robot) == LINE[1]) == counts


@pytest.mark.parametrize("kind", [ConscientiousReactive, CyclicPatrol, ExpectedReactive])
def test_without_a_path_to_any_place_a_robot_explores(kind):
    strategy, robot = kind(kind.Params()), bench(LINE, unreachable=LINE)
    assert strategy.choose(robot) == HIDDEN
    robot.known = []
    assert strategy.choose(robot) is None


def test_a_tour_is_shortened_by_reversing_parts_of_it():
    """From each place to the nearest, 0 1 2 3 4 would come back over a long way."""
    x = np.array([0.0, 1.0, -1.5, 4.0, -6.0])
    lengths = np.abs(x[:, None] - x)
    order = tour(lengths)
    assert order[0] == 0 and lengths[order, np.roll(order, -1)].sum() == 20.0  # there and back
    corners = np.array([[0, 0], [3, 3], [3, 0], [0, 3]], float)
    lengths = np.linalg.norm(corners[:, None] - corners, axis=2)
    order = tour(lengths)
    assert order[0] == 0 and lengths[order, np.roll(order, -1)].sum() == 12.0
    assert tour(np.zeros((1, 1))) == [0]


@pytest.mark.parametrize("seed", range(5))
def test_no_two_ways_of_a_tour_can_be_exchanged_for_shorter_ones(seed):
    places = np.random.default_rng(seed).uniform(size=(8, 2))
    lengths = np.linalg.norm(places[:, None] - places, axis=2)
    order = tour(lengths)
    assert sorted(order) == list(range(8))
    whole = lengths[order, np.roll(order, -1)].sum()
    for i in range(8):
        for j in range(i + 1, 8):
            other = order[:i] + order[i:j + 1][::-1] + order[j + 1:]
            assert lengths[other, np.roll(other, -1)].sum() >= whole - 1e-9


def test_robots_begin_at_equal_distances_on_the_tour():
    names = [f"robot_{i}" for i in (2, 10)]
    begins = [CyclicPatrol(CyclicPatrol.Params()).choose(
        bench(SQUARE, name, tuple(other for other in names if other != name))) for name in names]
    (ax, ay), (bx, by) = begins
    assert begins[0] == SQUARE[0] and (bx, by) == (-ax, -ay)  # the opposite corner


def test_a_tour_is_driven_in_turn_and_leaves_out_what_fails():
    strategy, robot = CyclicPatrol(CyclicPatrol.Params()), bench(LINE[:4])
    assert visits(strategy, robot, 5) == [3, 6, 9, 12, 3]
    strategy.on_goal(robot, LINE[1], GoalEnd.FAILED)
    assert strategy.choose(robot) == LINE[2]
    strategy.on_goal(robot, LINE[0], GoalEnd.REPLACED)
    strategy.on_goal(robot, Place(99.0, 0.0), GoalEnd.REACHED)  # where it explored
    assert strategy.choose(robot) == LINE[2]


def test_a_place_without_a_path_is_on_the_tour_from_when_there_is_one():
    blocked = {LINE[1]}
    robot, strategy = bench(LINE[:3], unreachable=blocked), CyclicPatrol(CyclicPatrol.Params())
    assert strategy.choose(robot) == HIDDEN  # there may be a path through what is unknown
    robot.known = []
    assert visits(strategy, robot, 3) == [3, 9, 3]
    blocked.clear()
    assert LINE[1] in [strategy.choose(robot), *[Place(x, 0.0) for x in visits(strategy, robot, 3)]]


def heard(strategy, robot, source, place, arrival_ns, sent_ns):
    (_, on_message), = robot.subscriptions
    on_message(robot, StrategyMessage(source, "intention", [place, arrival_ns], sent_ns))


def expecting(robot, speed="1 m/s"):
    strategy = ExpectedReactive(ExpectedReactive.Params(speed=speed))
    strategy.on_start(robot)
    return strategy


def test_the_idlest_place_per_second_of_driving_is_announced():
    robot = bench(LINE[:2])
    strategy = expecting(robot)
    robot.now_ns = 60 * S
    assert strategy.choose(robot) == LINE[0]
    assert [(one.topic, one.content) for one in robot.published] == [
        ("intention", [0, 63 * S + 1])]


def test_a_place_that_a_teammate_drives_to_is_expected_to_be_fresh():
    robot = bench(LINE[:2], team=("robot_2",))
    strategy = expecting(robot)
    robot.now_ns = 60 * S
    heard(strategy, robot, "robot_2", 0, 62 * S, 60 * S)
    assert strategy.choose(robot) == LINE[1]
    strategy.on_teammate(robot, "robot_2", True)
    assert strategy.choose(robot) == LINE[1]
    strategy.on_teammate(robot, "robot_2", False)  # lost: nobody comes
    assert strategy.choose(robot) == LINE[0]


def test_who_sets_out_anew_has_been_where_it_said():
    robot = bench(LINE[:2], team=("robot_2",))
    strategy = expecting(robot)
    heard(strategy, robot, "robot_2", 0, 50 * S, 40 * S)
    heard(strategy, robot, "robot_2", 1, 70 * S, 49 * S)  # it was there a second early
    assert strategy._visited_ns == {0: 49 * S}
    heard(strategy, robot, "robot_2", 0, 90 * S, 80 * S)
    assert strategy._visited_ns == {0: 49 * S, 1: 70 * S}
