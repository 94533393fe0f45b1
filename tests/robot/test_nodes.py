"""Nodes that publish by themselves: team states, declared traffic, transforms, a known map."""

import math
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest
from robot_fleets import Ears, Hosts

from desim.middleware.contents import Goal, GoalResult, Pose
from desim.ports import GridSpec, Peer, Place
from desim.ports.tasks import Ground
from desim.robot.declared_traffic import (
    Copied,
    CopyPublisher,
    PassiveListener,
    PeriodicPublisher,
    with_copies,
)
from desim.robot.mapping.map_receiver import MapReceiver, WholeMap
from desim.robot.mapping.map_server import MapServer, map_of_terrain
from desim.robot.mapping.tiles import TilePool, raster
from desim.robot.team import Team
from desim.robot.team_state import TeamState, TeamStateNode
from desim.robot.transform_broadcaster import (
    ODOMETRY_BYTES,
    ROBOT_BYTES,
    TransformBroadcaster,
    of_odometry,
    of_software,
)
from desim.scenario.schema.communication import TeamStateParams
from desim.scenario.schema.robot import Publication

S = 10**9


def team_states(period="1 s"):
    """``a`` has a body and ``b`` none; ``a`` says its pose, goals and results by ``ears``."""
    params = TeamStateParams(period=period)
    teams = {"a": Team(("b",), S), "b": Team(("a",), S)}
    return teams, Hosts(
        a=lambda host: [Ears(host, says=("pose", "goal", "goal_result")),
                        TeamStateNode(host, params, teams["a"], ("a",), True)],
        b=lambda host: [Ears(host, "/a/team_state"),
                        TeamStateNode(host, params, teams["b"], ("a",), False)])


def test_a_robot_tells_its_team_its_pose_and_its_goal():
    teams, hosts = team_states()

    def say(topic, content):
        hosts.nodes["a"][0].publish(topic, content)

    hosts.at(3 * S, lambda: say("pose", Pose(3 * S, 1.0, 2.0, 0.5)))
    hosts.at(4 * S + 1, lambda: say("goal", Goal(7.0, 8.0)))
    hosts.run(8 * S)
    peer = teams["b"].peers["a"]
    assert peer._replace(heard_ns=0) == Peer(1.0, 2.0, 0.5, 0, Place(7.0, 8.0))
    heard = [content for _, _, content in hosts.nodes["b"][0].heard]
    assert heard[0] == TeamState(1.0, 2.0, 0.5, None)  # nothing before the first pose
    assert heard[-1] == TeamState(1.0, 2.0, 0.5, Place(7.0, 8.0))
    assert len(heard) == 5


@pytest.mark.parametrize("topic, content", [
    ("goal", Goal(math.nan, math.nan)), ("goal_result", GoalResult(7.0, 8.0, True))])
def test_a_goal_that_is_over_is_none(topic, content):
    teams, hosts = team_states("100 ms")

    def say(name, what):
        hosts.nodes["a"][0].publish(name, what)

    hosts.at(S, lambda: say("pose", Pose(S, 1.0, 2.0, 0.5)))
    hosts.at(S, lambda: say("goal", Goal(7.0, 8.0)))
    hosts.at(2 * S, lambda: say(topic, content)).run(3 * S)
    goals = [state.goal for _, _, state in hosts.nodes["b"][0].heard]
    assert goals == [Place(7.0, 8.0)] * 10 + [None] * (len(goals) - 10) and len(goals) >= 19
    assert teams["b"].peers["a"].goal is None


def test_declared_messages_have_their_size_and_rate():
    publication = Publication(topic="front/camera", size="5 kB", rate="4 Hz", to="b")
    hosts = Hosts(a=lambda host: [PeriodicPublisher(host, publication)],
                  b=lambda host: [Ears(host, "/a/front/camera")]).run(10 * S)
    heard = hosts.nodes["b"][0].heard
    assert {content.size_bytes for *_, content in heard} == {5000}
    assert 39 <= len(heard) <= 40 and {
        late[0] - early[0] for early, late in zip(heard, heard[1:], strict=False)} == {S // 4}
    assert hosts.nodes["a"][0].name == "front_camera_publisher"


def test_of_a_driver_s_messages_all_processes_but_the_first_get_a_copy():
    assert with_copies("/a/scan", 3) == ["/a/scan", "/a/scan/copy_2", "/a/scan/copy_3"]
    assert with_copies("/a/scan", 1) == ["/a/scan"]
    copied = [Copied("/a/scan", 700, Fraction(10), 3), Copied("/a/odom", 700, Fraction(10), 2)]
    topics = ["/a/scan", "/a/scan/copy_2", "/a/scan/copy_3", "/a/odom", "/a/odom/copy_2"]
    hosts = Hosts(a=lambda host: [CopyPublisher(host, copied)],
                  b=lambda host: [Ears(host, *topics)]).run(S)
    heard = [(time_ns // 1000, topic) for time_ns, topic, _ in hosts.nodes["b"][0].heard]
    assert {topic for _, topic in heard} == {"/a/scan/copy_2", "/a/scan/copy_3", "/a/odom/copy_2"}
    assert len(heard) >= 30 and heard[-1][0] - heard[-4][0] == 100_000


def test_a_listener_takes_all_that_arrives():
    publication = Publication(topic="camera", size="5 kB", rate="4 Hz", to="b")
    hosts = Hosts(a=lambda host: [PeriodicPublisher(host, publication)],
                  b=lambda host: [PassiveListener(host, ["/a/camera"])]).run(10 * S)
    counts = hosts.graph.topics["/a/camera"].counts
    assert counts.delivered == counts.intended >= 39


@pytest.mark.parametrize("audience, topic", [("own", "/a/tf"), ("all", "/tf")])
def test_a_robot_with_two_lasers_has_a_transform_more(audience, topic):
    assert [(sent.topic, sent.size_bytes, sent.rate_hz, sent.start)
            for sent in of_software("a", audience, 2)] == [
        (topic, size, 10, "random") for size in (*ROBOT_BYTES, ROBOT_BYTES[-1])]
    assert len(of_software("a", audience, 1)) == 3
    assert of_odometry(["a"], Fraction(20), audience) == [(topic, ODOMETRY_BYTES, 20, "zero")]


def test_transforms_are_sent_once_for_each_process():
    sent = of_odometry(["a"], Fraction(20), "own")
    hosts = Hosts(
        a=lambda host: [TransformBroadcaster(host, "sim", sent, None, 2)],
        b=lambda host: [Ears(host, "/a/tf", "/a/tf/copy_2"),
                        TransformBroadcaster(host, "tf", [], "/a/tf", 2)]).run(S)
    heard = hosts.nodes["b"][0].heard
    assert {content.size_bytes for *_, content in heard} == {ODOMETRY_BYTES}
    assert [len([1 for _, one, _ in heard if one == topic])
            for topic in ("/a/tf", "/a/tf/copy_2")] == [len(heard) // 2] * 2
    assert len(heard) in (40, 42)


class Map:
    """As much of a ``RobotMap`` as these nodes use."""

    def __init__(self, changes=True):
        self.received, self.replaced, self._changes = [], [], changes

    def receive(self, parts):
        self.received += parts

    def replace_own(self, layer):
        self.replaced.append(layer)
        return self._changes


def test_a_known_map_is_announced_until_somebody_uses_it():
    own = Map()
    hosts = Hosts(a=lambda host: [MapServer(host, own, "terrain"),
                                  Ears(host, "map", says=("costmap",))])
    hosts.at(3 * S + 1, lambda: hosts.nodes["a"][1].publish("costmap", SimpleNamespace(
        size_bytes=0))).run(10 * S)
    assert own.received == [("map_server", 0, "terrain")]
    assert len(hosts.nodes["a"][1].heard) == 3


def test_a_terrain_is_walls_and_what_a_laser_can_reach():
    solid = np.array([[1, 0, 0], [0, 1, 0]], np.uint8)
    reachable = np.array([[0, 1, 0], [1, 0, 0]], bool)
    grid = GridSpec(0.2, 3, 2, 0.0, 0.0)
    layer = map_of_terrain(TilePool(), Ground(grid, solid, reachable))
    signs = np.sign(raster(grid, layer.cells())[:2, :3])
    assert signs.tolist() == [[1, -1, 0], [-1, 1, 0]]


@pytest.mark.parametrize("changes, announced", [(True, 1), (False, 0)])
def test_a_map_that_changes_nothing_is_not_announced(changes, announced):
    own = Map(changes)
    hosts = Hosts(a=lambda host: [MapReceiver(host, own), Ears(host, "map", says=("slam_map",))])
    whole = WholeMap("layer", 100)
    hosts.at(S, lambda: hosts.nodes["a"][1].publish("slam_map", whole)).run(2 * S)
    assert own.replaced == ["layer"] and len(hosts.nodes["a"][1].heard) == announced
