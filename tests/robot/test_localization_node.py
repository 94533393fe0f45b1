"""The node of a localization: when it is asked, what it may draw, and what it publishes."""

import math
import re

import numpy as np
import pytest
from robot_fleets import Ears, Hosts

from desim.errors import ModelError
from desim.middleware.contents import LaserScan, Pose
from desim.ports import GridSpec, Pose2D
from desim.ports.localization import LocalizationTraits
from desim.robot.localization.checks import checked_path, checked_pose, drawable, writes_checked
from desim.robot.localization.node import LocalizationNode
from desim.robot.localization.pose_publisher import Correction, CorrectionNode, PosePublisher
from desim.robot.localization.remote_slam import RemoteSlam
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import TilePool
from desim.scenario.schema.robot import Equipment

MS, S = 10**6, 10**9
SPEC = GridSpec(0.2, 60, 60, -6.0, -6.0)


class Silent:
    """A localization that adds a metre to the odometry's x, and notes what it gets."""

    def __init__(self):
        self.seen = []

    def start(self, context):
        self.context = context

    def on_odometry(self, context, odometry, scan):
        self.seen.append((context.now_ns, odometry, None if scan is None else scan.odometry))
        return odometry._replace(x_m=odometry.x_m + 1.0)


class Drawing(Silent):
    """One that draws each scan where the odometry is."""

    traits = LocalizationTraits(draws_map=True)

    def on_odometry(self, context, odometry, scan):
        if scan is not None:
            context.draw(scan, scan.odometry)
        return super().on_odometry(context, odometry, scan)


def scan(stamp_ns, range_m=2.0):
    return LaserScan(stamp_ns, np.full(90, range_m, np.float32), -math.pi / 2, math.pi / 90, 8.0)


def play(plug_in, *says, kind=LocalizationNode, until_ns=10 * S, **options):
    """``says``: (time_ns, topic, content) that the robot's sensors publish."""
    robot_map = RobotMap(SPEC, TilePool())
    hosts = Hosts(a=lambda host: [
        Ears(host, "pose", "map", "map_to_odom", "slam_map", says=("odom", "scan")),
        kind(host, *(("a",) if kind is RemoteSlam else ()), plug_in, Equipment(**options),
             robot_map, Pose2D(1.0, 2.0, 0.0), 0.5)])
    ears = hosts.nodes["a"][0]
    for time_ns, topic, content in says:
        hosts.at(time_ns, lambda topic=topic, content=content: ears.publish(topic, content))
    hosts.run(until_ns)
    return ears.heard, robot_map, hosts


def odometry(time_ns, x_m=0.0, yaw_rad=0.0):
    return time_ns, "odom", Pose(time_ns, x_m, 0.0, yaw_rad)


def laser(time_ns, stamp_ns=None):
    return time_ns, "scan", scan(time_ns if stamp_ns is None else stamp_ns)


def test_the_pose_is_what_the_plug_in_says_at_each_reading():
    heard, *_ = play(Silent(), odometry(S), odometry(2 * S, 0.5, 7.0))
    assert [(time_ns, topic, content[:3]) for time_ns, topic, content in heard] == [
        (S, "pose", (S, 1.0, 0.0)), (2 * S, "pose", (2 * S, 1.5, 0.0))]
    assert heard[1][2].yaw_rad == pytest.approx(7.0 - math.tau)  # between -pi and pi


def test_what_a_plug_in_learns_of_its_robot():
    plug_in = Silent()
    _, _, hosts = play(plug_in, laser={"field_of_view": "180 deg", "beams": 181})
    context = plug_in.context
    assert (context.name, context.start, context.bodies_m) == ("a", Pose2D(1.0, 2.0, 0.0), 0.5)
    assert context.laser.angle_min_rad == pytest.approx(-math.pi / 2)
    assert context.laser.increment_rad == pytest.approx(math.pi / 180)
    assert hosts.nodes["a"][1].name == "localization"
    assert hosts.nodes["a"][1].kept() == {"cells": 0}


def test_a_scan_belongs_to_the_reading_of_its_instant():
    plug_in = Silent()
    play(plug_in, odometry(S - 1), laser(S), odometry(S), laser(S + 100 * MS),
         odometry(S + 100 * MS + 1), laser(S + 150 * MS), odometry(S + 150 * MS, 0.5),
         odometry(S + 160 * MS))
    assert [at for _, _, at in plug_in.seen] == [
        None, Pose2D(0.0, 0.0, 0.0), None, Pose2D(0.5, 0.0, 0.0), None]


@pytest.mark.parametrize("late_ns, between", [(250 * MS + 1, True), (250 * MS, False)])
def test_where_stamps_never_agree_the_odometry_of_a_scan_is_interpolated(late_ns, between):
    """After 0.25 s without a scan of the instant of a reading."""
    plug_in = Silent()
    play(plug_in, laser(S), odometry(S), laser(S + 200 * MS), odometry(S + 150 * MS),
         odometry(S + late_ns, 1.0))
    whole_ns = late_ns - 150 * MS
    assert plug_in.seen[0][2] == Pose2D(0.0, 0.0, 0.0) and plug_in.seen[1][2] is None
    assert plug_in.seen[2][2] == (
        pytest.approx((50 * MS / whole_ns, 0.0, 0.0)) if between else None)


def test_a_plug_in_that_draws_makes_the_map_and_announces_it():
    heard, robot_map, hosts = play(Drawing(), laser(S), odometry(S), laser(2 * S),
                                   odometry(2 * S, 0.5))
    assert [(time_ns, topic) for time_ns, topic, _ in heard] == [
        (S, "map"), (S, "pose"), (2 * S, "map"), (2 * S, "pose")]
    assert robot_map.version == 2
    node = hosts.nodes["a"][1]
    assert node.name == "slam" and node.kept() == {"cells": 3600}


def redrawn(path):
    """The events of a plug-in that has drawn two scans, and draws the map anew from ``path``."""
    plug_in = Drawing()
    heard, _, hosts = play(plug_in, laser(S), odometry(S), laser(2 * S), odometry(2 * S, 0.5),
                           until_ns=3 * S)
    count, node = len(heard), hosts.nodes["a"][1]
    hosts.at(3 * S + 1, lambda: node.redraw(np.array(path))).run(4 * S)
    return [topic for _, topic, _ in heard[count:]], node


@pytest.mark.parametrize("path, drawn", [
    ([(0.0, 0.0, 0.0), (0.5, 0.0, 0.0)], False), ([(0.0, 0.0, 0.0), (0.625, 0.0, 0.0)], False),
    ([(0.0, 0.0, 0.0), (0.5, 0.25, 0.0)], True), ([(0.0, -0.25, 0.0), (0.5, 0.0, 0.0)], True),
    ([(0.0, 0.0, 0.0), (0.5, 0.0, 0.009)], False), ([(0.0, 0.0, -0.011), (0.5, 0.0, 0.0)], True),
    ([(0.0, 0.0, math.tau), (0.5, 0.0, 0.0)], False)])
def test_a_map_is_drawn_anew_when_a_pose_has_moved_by_a_cell_or_turned(path, drawn):
    events, node = redrawn(path)
    assert events == ["map"] * drawn
    assert np.allclose(node._drawn, path if drawn else [(0, 0, 0), (0.5, 0, 0)])


def test_there_is_nothing_to_draw_anew_before_the_first_scan():
    heard, _, hosts = play(Drawing(), odometry(S))
    hosts.at(11 * S, lambda: hosts.nodes["a"][1].redraw(np.zeros((0, 3)))).run(12 * S)
    assert [topic for _, topic, _ in heard] == ["pose"]


PATH = "draws the map anew with {}; wanted: finite poses [2, 3], one for each scan that was drawn"
WRONG = [
    (lambda: drawable(Silent(), 1, 1, Pose2D(0.0, 0.0, 0.0)),
     "draws a scan; wanted: traits = LocalizationTraits(draws_map=True) in its class"),
    (lambda: drawable(Drawing(), 1, None, Pose2D(0.0, 0.0, 0.0)),
     "draws something else than the scan that has just come, or that twice; wanted: that scan, "
     "once"),
    (lambda: drawable(Drawing(), [], [], Pose2D(0.0, 0.0, 0.0)),
     "draws something else than the scan that has just come, or that twice; wanted: that scan, "
     "once"),
    (lambda: drawable(Drawing(), WRONG, WRONG, (0.0, 0.0, 0.0)),
     "draws a scan from (0.0, 0.0, 0.0); wanted: a Pose2D of three finite numbers"),
    (lambda: checked_pose(Silent(), None),
     "returned None in on_odometry; wanted: a Pose2D of three finite numbers"),
    (lambda: checked_path(Silent(), [(0.0, 0.0, 0.0)] * 2, 2), PATH.format("list")),
    (lambda: checked_path(Silent(), np.zeros((3, 3)), 2), PATH.format("float64 [3, 3]")),
    (lambda: checked_path(Silent(), np.zeros((2, 3), int), 2), PATH.format("int64 [2, 3]")),
    (lambda: checked_path(Silent(), np.full((2, 3), np.nan), 2), PATH.format("float64 [2, 3]")),
]


@pytest.mark.parametrize("act, says", WRONG, ids=[says for _, says in WRONG])
def test_what_a_plug_in_does_wrong_is_said(act, says):
    with pytest.raises(ModelError, match=f"{re.escape(says)}$"):
        act()


def test_what_it_does_right_is_taken_as_it_is():
    pose, path, last = Pose2D(0.0, 1.0, 2.0), np.zeros((2, 3), np.float32), object()
    assert checked_pose(Silent(), pose) is pose and checked_path(Silent(), path, 2) is path
    assert drawable(Drawing(), last, last, pose) is last


def test_scans_are_not_written_to():
    ranges = np.zeros(3)
    ranges.flags.writeable = False
    with pytest.raises(ModelError, match="writes into what it may only read, as scans are "), \
            writes_checked(Silent()):
        ranges[0] = 1.0
    with pytest.raises(ValueError, match="^another$"), writes_checked(Silent()):
        raise ValueError("another")


def test_a_correction_takes_the_odometry_to_the_pose():
    heard, *_ = play(Silent(), odometry(S, 2.0, 0.5), kind=CorrectionNode)
    (_, topic, correction), = heard
    assert topic == "map_to_odom"
    assert correction.transform == pytest.approx((1.0, 0.0, 0.0), abs=1e-12)


def test_a_pose_follows_the_odometry_from_the_last_correction_on():
    hosts = Hosts(a=lambda host: [Ears(host, "pose", says=("odom", "map_to_odom")),
                                  PosePublisher(host)])
    ears = hosts.nodes["a"][0]
    for time_ns, topic, content in (
            odometry(S), (2 * S, "map_to_odom", Correction(Pose2D(1.0, 2.0, math.pi / 2))),
            odometry(3 * S, 0.5), odometry(4 * S, 1.0)):
        hosts.at(time_ns, lambda topic=topic, content=content: ears.publish(topic, content))
    hosts.run(5 * S)
    assert [content for *_, content in ears.heard] == [
        pytest.approx((3 * S, 1.0, 2.5, math.pi / 2)),
        pytest.approx((4 * S, 1.0, 3.0, math.pi / 2))]


def test_remote_slam_sends_its_first_map_and_then_one_a_period_if_it_has_changed():
    heard, robot_map, _ = play(Drawing(), laser(S), odometry(S), laser(1500 * MS),
                               odometry(1500 * MS, 0.5), kind=RemoteSlam, until_ns=30 * S,
                               localization={"map_period": "2 s"})
    maps = [(time_ns, content) for time_ns, topic, content in heard if topic == "slam_map"]
    assert maps[0][0] == S and len(maps) == 2 and 1500 * MS < maps[1][0] <= 3500 * MS
    assert {whole.cells for _, whole in maps} == {3600 + robot_map.padding}
    assert [topic for _, topic, _ in heard if topic == "map_to_odom"] == ["map_to_odom"] * 2
