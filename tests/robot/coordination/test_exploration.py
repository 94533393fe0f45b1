"""The explore node, as a log of the goals that it sends."""

import math
from functools import partial

import numpy as np
import pytest
from drawn import Drawn, cells, costmap

from desim import plugins
from desim.engine.kernel import Kernel
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace, real
from desim.errors import ModelError
from desim.middleware.contents import Empty, GoalResult, Lazy, Pose
from desim.middleware.direct import Direct
from desim.middleware.graph import Graph
from desim.middleware.node import Node
from desim.ports import Frontier, GoalEnd, Peer, Place
from desim.robot.coordination.blacklist import Blacklist
from desim.robot.coordination.explore import Explore
from desim.robot.coordination.strategies.nearest_frontier import NearestFrontier
from desim.robot.coordination.strategies.random_frontier import RandomFrontier
from desim.robot.localization.sensor_pose import SENSORS, SensorPose
from desim.robot.navigation.map_queries import MapQueries
from desim.robot.team import Team
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.navigation import Navigation
from desim.scenario.schema.robot import ExplorationParams

S = 10**9

# 6 m x 3 m; the robot stands in the middle of a known square, with the unknown on both sides.
START = ["#" * 30] + ["?" * 9 + "." * 14 + "?" * 7] * 13 + ["#" * 30]
LEFT_KNOWN = ["#" * 30] + ["#" + "." * 22 + "?" * 7] * 13 + ["#" * 30]
ALL_KNOWN = ["#" * 30] + ["#" + "." * 28 + "#"] * 13 + ["#" * 30]


class Script(Node):
    """Everything around the explore node: pose, costmap, results. ``log`` has its goals."""

    def __init__(self, host):
        super().__init__(host, "script")
        self.log = []
        self.answer = None  # for the next goal: reached or not

    def start(self):
        for topic in ("pose", "goal_result", "peers"):
            self.advertise(topic)
        self.advertise("costmap", latch=True)
        self.subscribe("goal", self.note)
        self.timer(10, lambda _: self.publish("pose", Pose(self.now_ns, 2.9, 1.5, 0.0)), "zero")
        self.after(0, lambda _: self.publish("costmap", Empty()))

    def note(self, message):
        goal = message.content
        self.log.append((self.now_ns // S, None if math.isnan(goal.x_m)
                         else (round(goal.x_m, 1), round(goal.y_m, 1))))
        if self.answer is not None and not math.isnan(goal.x_m):
            self.after(S // 10, lambda _: self.publish(
                "goal_result", GoalResult(goal.x_m, goal.y_m, self.answer)))


class Play:
    """An explore node with a strategy, and the script around it."""

    def __init__(self, lines=START, strategy=None, **exploration):
        self.kernel, self.names, self.rows = Kernel(), Names(), []
        self.trace = Trace(self.names, self.rows.append)
        self.graph = Graph(self.kernel, self.names, self.trace, Streams(3), Direct(), ["r0"])
        host = self.graph.host("r0")
        self.robot_map = Drawn(cells(lines))
        self.script, team = Script(host), Team((), S)
        self.peers, params = team.peers, ExplorationParams(**exploration)
        strategy = strategy or NearestFrontier(NearestFrontier.Params())
        queries = MapQueries(costmap(self.robot_map), params, Navigation().goal_tolerance_m, 25.0)
        self.explore = Explore(host, params, strategy, Navigation(), BodyType(), queries, team,
                               "scan", lambda: None)
        host.software = lambda _: [self.script, self.explore]
        self.graph.start()

    def at(self, seconds, fn):
        self.kernel.at(seconds * S, 0, 0, lambda _: fn())
        return self

    def know(self, lines):
        self.robot_map.know(cells(lines))

    def run(self, seconds):
        self.kernel.run(seconds * S)
        return self.script.log


def test_nearest_first_and_the_next_when_what_was_unknown_is_known():
    play = Play()
    play.at(10, lambda: play.know(LEFT_KNOWN)).at(20, lambda: play.know(ALL_KNOWN))
    (first_s, first), (second_s, second), (third_s, third) = play.run(30)
    assert (first_s, second_s, third_s) == (0, 10, 20)
    assert first[0] < 2.9 < second[0]  # the left edge is nearer
    assert third is None  # nothing left: stop


def test_one_goal_as_long_as_nothing_changes_near_it():
    play = Play()
    play.at(10, lambda: play.know(START[:1] + ["?" * 9 + "." * 15 + "?" * 6] * 13 + START[-1:]))
    assert len(play.run(30)) == 1


def test_it_goes_on_when_a_map_arrives_later():
    play = Play(ALL_KNOWN)
    play.at(15, lambda: play.know(LEFT_KNOWN))
    assert [second for second, _ in play.run(30)] == [15]


def test_a_goal_given_up_is_avoided_for_a_while():
    play = Play(blacklist_for="8 s", blacklist_radius="2 m")
    play.script.answer = False
    log = play.run(12)
    sides = [(second, "left" if goal[0] < 2.9 else "right") for second, goal in log]
    assert sides[:2] == [(0, "left"), (1, "right")]
    # both are on the list until the first has been there for 8 s
    assert sides[2:] == [(9, "left"), (10, "right")]


def test_a_goal_given_up_for_good_is_never_tried_again():
    for blacklist_for, tries in ((None, 2), ("8 s", 4)):  # the twin tries again
        play = Play(blacklist_for=blacklist_for, blacklist_radius="2 m")
        play.script.answer = False
        assert len(play.run(12)) == tries


def test_a_blacklist_of_cells_covers_those_cells():
    """5 cells around as explore_lite's, 2 as explore_multirobot's, along the axes; with 3, rounding
    would lose one."""
    for reach in (5, 3, 2):
        blacklist = Blacklist(ExplorationParams(blacklist_radius=f"{reach / 5:g} m",
                                                blacklist_for=None), 100, 0.2)
        blacklist.add(40 * 100 + 50, 0)
        blacklist.expire(10**15)
        assert blacklist.discs().tolist() == [[40, 50, reach * reach]]


def test_a_frontier_still_there_after_two_visits_is_avoided():
    play = Play(blacklist_radius="2 m")
    play.script.answer = True
    log = play.run(6)
    assert [goal[0] < 2.9 for _, goal in log] == [True, True, False, False]


def test_a_result_of_an_older_goal_means_nothing():
    play = Play()
    play.at(5, lambda: play.script.publish("goal_result", GoalResult(0.1, 0.1, False)))
    assert len(play.run(20)) == 1


def test_another_goal_replaces_one_and_the_same_changes_nothing():
    ended = []

    class Passive:
        def choose(self, view):
            return None

        def on_goal(self, view, place, end):
            ended.append((view.now_ns // S, place, end))

    play = Play(LEFT_KNOWN, Passive())
    places = (Place(2.0, 1.5), Place(2.0, 1.5), Frontier(2.0, 1.5, 0.9, 7), Place(3.5, 1.5))
    for second, place in enumerate(places, 1):
        play.at(second, partial(play.explore.go, place))
    assert play.run(6) == [(1, (2.0, 1.5)), (4, (3.5, 1.5))]
    assert ended == [(4, (2.0, 1.5), GoalEnd.REPLACED)]


def test_goals_are_on_record():
    play = Play()
    (_, goal), = play.run(3)
    play.trace.flush()
    row, = [row for rows in play.rows for row in rows if play.names[int(row["kind"])] == "goal"]
    assert (round(real(int(row["a"])), 1), round(real(int(row["b"])), 1)) == goal
    assert row["c"] == 11  # cells of the left edge that are not too near to a wall


class Curious:
    """A strategy that notes what it sees, and stays."""

    def __init__(self):
        self.seen = []

    def choose(self, view):
        self.seen.append((view.name, view.now_ns // S, view.pose, dict(view.peers),
                          len(view.frontiers()), len(view.frontiers(limit=1)),
                          view.stream("x").integers(100)))


def test_what_a_strategy_sees():
    strategy = Curious()
    play = Play(strategy=strategy)
    play.peers["r7"] = Peer(1.0, 2.0, 3.0, S // 100)
    play.run(1)
    (name, second, pose, peers, frontiers, nearest, number), = strategy.seen
    assert (name, second, pose) == ("r0", 0, (2.9, 1.5, 0.0))
    assert peers == {"r7": Peer(1.0, 2.0, 3.0, S // 100)}
    assert (frontiers, nearest) == (2, 1)
    assert number == Streams(3)("host", "r0", "explore", "strategy", "x").integers(100)


class Restless:
    """A strategy that looks for frontiers whenever its map has changed, also on its way."""

    def choose(self, view):
        return next(iter(view.frontiers()), None)

    def on_map(self, view):
        if view.goal is not None:
            view.go(view.frontiers()[-1])


def test_all_frontiers_that_a_strategy_looks_at_are_displayed():
    play, shown = Play(strategy=Restless()), []
    play.graph.on_display = lambda host, kind, points, texts: shown.append(
        (play.kernel.now_ns // S, kind, len(points)))
    play.at(5, lambda: play.know(LEFT_KNOWN))
    assert len(play.run(10)) == 2
    assert [entry for entry in shown if entry[1] == "frontiers"] == [
        (0, "frontiers", 2), (5, "frontiers", 1)]


def test_a_strategy_of_ones_own_may_choose_any_place():
    class Fixed:
        def choose(self, view):
            return Place(2.5, 1.5)

    play = Play(strategy=Fixed())
    play.script.answer = True
    assert play.run(4) == [(k, (2.5, 1.5)) for k in range(4)]


class Stubborn:
    """Wants to be at one place, and counts how often it was asked."""

    def __init__(self, place):
        self.place, self.asked_s = place, []

    def choose(self, view):
        self.asked_s.append(view.now_ns // S)
        return self.place


def test_a_place_that_is_not_free_is_no_goal_and_is_asked_for_again():
    """As with go, and also where the map does not change."""
    stubborn = Stubborn(Place(0.5, 1.5))  # unknown at first
    play = Play(strategy=stubborn)
    play.script.answer = None
    play.at(12, lambda: play.know(ALL_KNOWN))
    assert play.run(20) == [(15, (0.5, 1.5))]
    assert stubborn.asked_s == [0, 5, 10, 15]


@pytest.mark.parametrize("place", [Place(-9.0, 1.5), Place(math.nan, 1.5), (2.5, 1.5)])
def test_nonsense_is_an_error_and_no_place_that_is_not_free(place):
    with pytest.raises(ModelError, match=r"Stubborn.* chose .*; wanted: .* a Place on the "):
        Play(strategy=Stubborn(place)).run(4)


def test_random_frontier_draws_from_all():
    class View:
        def __init__(self, count):
            self.count, self.rng = count, np.random.Generator(np.random.PCG64(5))

        def frontiers(self, limit=None):
            return [Frontier(float(i), 0.0, 1.0, 4) for i in range(self.count)][:limit]

        def stream(self, *name):
            return self.rng

    strategy = RandomFrontier(RandomFrontier.Params())
    view = View(3)
    assert {strategy.choose(view).x_m for _ in range(50)} == {0.0, 1.0, 2.0}
    assert strategy.choose(View(0)) is None


@pytest.mark.parametrize("name, topic", [("ground_truth", "true_pose"), ("odometry", "odom")])
def test_localization_passes_on_its_sensor_unread(name, topic):
    cls = plugins.load("localization", name)
    kernel, names = Kernel(), Names()
    graph = Graph(kernel, names, Trace(names), Streams(1), Direct(), ["r0"])
    host, read, got = graph.host("r0"), [], []

    class Ends(Node):
        def start(self):
            self.advertise(topic)
            self.subscribe("pose", got.append)
            self.after(S, lambda _: self.publish(topic, reading()))

    def reading():
        return Lazy(729, lambda: read.append(1) or Pose(S, 1.0, 2.0, 3.0))

    host.software = lambda _: [Ends(host, "ends"), SensorPose(host, SENSORS[cls])]
    graph.start()
    kernel.run(2 * S)
    message, = got
    assert (message.size_bytes, read) == (729, [])
    assert message.content == Pose(S, 1.0, 2.0, 3.0)
    assert read == [1]
