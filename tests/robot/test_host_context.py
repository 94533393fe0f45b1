"""A strategy's context on a host: what it knows, what it may do, and what that costs."""

from types import SimpleNamespace

import numpy as np
import pytest
from drawn import costmap, drawn
from robot_fleets import Hosts

from desim.errors import InputError, ModelError
from desim.middleware.node import Node
from desim.ports import Mark, Peer, Place, Pose2D
from desim.robot.coordination.context import HostContext
from desim.robot.coordination.coordinate import Coordinate
from desim.robot.coordination.strategy_messages import MessageCount, encoded
from desim.robot.coordination.task_link import TaskLink
from desim.robot.navigation.map_queries import MapQueries
from desim.robot.team import Team
from desim.scenario.schema.robot import ExplorationParams

S = 10**9
ROOM = ["." * 18 + "?" * 7] * 15


class Body:
    """A robot that notes what it is asked to do."""

    def __init__(self):
        self.done = []

    def pose(self):
        return Pose2D(1.0, 1.5, 0.0)

    def goal(self):
        return Place(3.0, 1.5)

    def go(self, place):
        self.done.append(place)
        return True

    def stop_driving(self):
        self.done.append("stop")

    def discs(self):
        return np.zeros((0, 3), np.int64)

    def show(self, frontiers):
        self.done.append(len(frontiers))


class Mind(Node):
    """The node of a context: ``begin(context)`` is its start, ``works`` the work that it notes."""

    def __init__(self, host, team, body, begin, common_frame=True):
        super().__init__(host, "mind")
        self.works, self._begin = [], begin
        self.team = Team(team, S, lambda message: lambda: -50.0, common_frame)
        queries = MapQueries(costmap(drawn(*ROOM)), ExplorationParams(), 0.4, 8.0)
        self.worked = lambda **quantities: self.works.append(quantities)
        self.context = HostContext(self, self.team, queries, body, TaskLink("briefing"))

    def start(self):
        self._begin(self.context)


def alone(body=None, begin=lambda context: None, **options):
    hosts = Hosts(a=lambda host: [Mind(host, (), body, begin, **options)]).run(S)
    return hosts.nodes["a"][0]


def test_a_host_without_a_body_has_no_place_and_does_not_drive():
    context = alone().context
    assert (context.name, context.has_body, context.pose, context.goal) == ("a", False, None, None)
    assert (context.task, context.now_ns, context.team) == ("briefing", S, ())
    for act in (context.stop, lambda: context.go(Place(0.0, 0.0))):
        with pytest.raises(ModelError, match="^a has no body that could drive$"):
            act()
    with pytest.raises(ModelError, match="this host has no pose; give an origin$"):
        context.frontiers()
    assert len(context.frontiers(origin=Place(1.0, 1.5))) == 1


def test_a_robot_gets_what_its_strategy_wants_and_sees():
    body = Body()
    context = alone(body).context
    assert (context.has_body, context.pose, context.goal) == (
        True, Pose2D(1.0, 1.5, 0.0), Place(3.0, 1.5))
    assert context.go(Place(2.0, 2.0))
    context.stop()
    found = context.frontiers()
    assert body.done == [Place(2.0, 2.0), "stop", len(found)] and found


def test_searches_are_work():
    mind = alone(Body())
    found = mind.context.frontiers()
    mind.context.path_lengths_m([(1.0, 1.0), (2.0, 1.0)])
    mind.context.gain_m2((1.0, 1.0))
    mind.context.worked(beams=3)
    assert mind.works == [{"plans": 1, "cells": 375, "candidates": len(found)},
                          {"plans": 1, "cells": 375, "candidates": 2}, {"candidates": 1},
                          {"beams": 3}]


def test_what_it_sees_cannot_be_written_to():
    context = alone().context
    assert context.grid.width == 25 and context.occupancy().shape == context.costmap().shape
    for values in (context.occupancy(), context.costmap()):
        with pytest.raises(ValueError, match="read-only"):
            values[0, 0] = 0
    with pytest.raises(TypeError):
        context.peers["b"] = None


def test_timers_go_off_once_or_again_and_again():
    log = []

    def begin(context):
        context.after(0, lambda context: log.append((context.now_ns, "once")))
        context.after(S, lambda context: log.append((context.now_ns, "late")))
        context.every(S // 2, lambda context: log.append((context.now_ns, "again")))

    hosts = Hosts(a=lambda host: [Mind(host, (), None, begin)]).run(3 * S)
    assert (0, "once") in log and (S, "late") in log and len(log) in (8, 9)
    again = [time_ns for time_ns, what in log if what == "again"]
    assert {late - early for early, late in zip(again, again[1:], strict=False)} == {S // 2}
    assert hosts.nodes["a"][0].context._waiting == 1  # the periodic one


def test_ten_thousand_timers_may_wait_at_a_time():
    def begin(context):
        for _ in range(5000):
            context.after(S, lambda context: None)
            context.every(10 * S, lambda context: None)
        for more in (context.after, context.every):
            with pytest.raises(ModelError, match="^10000 timers of this strategy wait"):
                more(S, lambda context: None)

    alone(begin=begin)


def speaking(content, size_bytes=None, queue=1):
    """``b`` hears of ``a``, and of its mind."""
    heard = []

    def say(context):
        context.advertise("bid", queue=queue)
        context.after(S, lambda context: context.publish("bid", content, size_bytes))

    hosts = Hosts(
        a=lambda host: [Mind(host, ("b",), None, say)],
        b=lambda host: [Mind(host, ("a",), None, lambda context: context.subscribe(
            "bid", lambda context, message: heard.append(message)))]).run(3 * S)
    return heard, hosts


@pytest.mark.parametrize("content, size_bytes", [({"a": [1, 2]}, None), ({1, 2}, 700)])
def test_a_message_arrives_as_it_was_published(content, size_bytes):
    (message,), hosts = speaking(content, size_bytes)
    assert (message.source, message.topic, message.content, message.sent_ns) == (
        "a", "bid", content, S)
    assert hosts.graph.topics["/a/strategy/bid"].counts.delivered == 1
    link = hosts.nodes["b"][0].context.links()["a"]
    assert link.heard_ns >= S and link.signal_dbm == -50.0


def test_who_does_not_know_where_others_started_cannot_speak_of_places():
    def begin(context):
        with pytest.raises(InputError, match="^coordination.strategy: it speaks to its team, of "
                                             "places that mean nothing"):
            context.advertise("bid")

    alone(begin=begin, common_frame=False)


def test_topics_are_advertised_once_and_before_they_are_published():
    def begin(context):
        with pytest.raises(ModelError, match="'bid' is published but not advertised"):
            context.publish("bid", 1)
        context.advertise("bid")
        with pytest.raises(ModelError, match="'bid' is advertised a second time"):
            context.advertise("bid")
        with pytest.raises(ModelError, match="broadcasts"):
            context.advertise("ask", via="broadcasts")

    alone(begin=begin)


def test_what_is_shown_is_seen_by_who_looks():
    mind, shown = alone(), []
    mind.context.show("plan", [(1.0, 2.0, "here")])  # nobody looks
    mind._graph.on_display = lambda *what: shown.append(what)
    mind.context.show("plan", [Mark(1.0, 2.0, "here")])
    mind.context.show("plan", [])
    (name, kind, places, texts), (*_, none, no_texts) = shown
    assert (name, kind, places.tolist(), texts) == ("a", "plan", [[1.0, 2.0]], ("here",))
    assert none.shape == (0, 2) and no_texts == ()


def test_a_coordinator_notes_its_team_and_its_map():
    log = []

    class Watcher:
        def on_start(self, context):
            log.append((context.now_ns, "start", context.has_body))

        def on_map(self, context):
            log.append((context.now_ns // S, "map"))

        def on_teammate(self, context, name, heard):
            log.append((context.now_ns // S, name, heard))

        def choose(self, context):
            return None

    team, robot_map = Team(("b",), 3 * S), drawn(*ROOM)
    queries = MapQueries(costmap(robot_map), ExplorationParams(), 0.4, 8.0)
    hosts = Hosts(a=lambda host: [Coordinate(host, 1, Watcher(), queries, team, TaskLink())])
    hosts.at(5 * S, lambda: team.note_pose("b", 0.0, 0.0, 0.0, 0, 5 * S)).run(20 * S)
    assert log[0] == (0, "start", False) and log[1][1] == "map" and log[1][0] <= 1
    assert [row[1:] for row in log[2:]] == [("b", True), ("b", False)]
    assert log[2][0] in (5, 6) and log[3][0] in (8, 9)
    assert team.peers["b"] == Peer(0.0, 0.0, 0.0, 5 * S)
    assert hosts.nodes["a"][0].kept() == {"cells": 375}


def test_messages_of_one_instant_end():
    count = MessageCount()
    for _ in range(10_000):
        count.add("bid", 0, 500)
    count.add("bid", 1, 500)  # another instant
    for _ in range(9_999):
        count.add("bid", 1, 0)
    for answers, count_ in ((0, count), (501, MessageCount())):
        with pytest.raises(ModelError, match=r"^messages of one instant do not end \(topic 'bid'"):
            count_.add("bid", 1, answers)


def test_what_cannot_be_encoded_is_said():
    with pytest.raises(ModelError, match=r"^JSON cannot hold \{1\} \(TypeError: .* size_bytes$"):
        encoded({1}, None)
    with pytest.raises(ModelError, match="cannot be pickled"):
        encoded(lambda: None, 5)
    assert encoded(SimpleNamespace(a=1), 5).decoded().a == 1
