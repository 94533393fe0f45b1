"""Robots as programs of ROS 2 see them, in the guest. Skipped where that or Cyclone DDS is missing.
"""

from __future__ import annotations

import math

import pytest
from loop_guests import Program, played, refuse_without_guest, said

pytest.importorskip("cyclonedds", reason="pip install 'desim[loop]'")

# A participant of its own, as rclpy would have it, on the topics of its robot.
HEAD = """
import math, os, time
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from desim.loop.ros2_messages import kind, make

participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
reliable = Policy.Reliability.Reliable(duration(milliseconds=100))
sensor_data = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(5))
latched = Qos(reliable, Policy.Durability.TransientLocal, Policy.History.KeepLast(1))
default = Qos(reliable, Policy.History.KeepLast(10))

def topic(name, message):
    return Topic(participant, f"rt/robot_0/{name}", kind(message))

scans = DataReader(participant, topic("scan", "sensor_msgs/LaserScan"), qos=sensor_data)
odometry = DataReader(participant, topic("odom", "nav_msgs/Odometry"), qos=default)
motors = DataWriter(participant, topic("cmd_vel", "geometry_msgs/Twist"), qos=default)
"""
# Stands for two seconds, and then drives ahead.
DRIVER = HEAD + """
for step in range(50):
    time.sleep(0.1)
    if step >= 20:
        motors.write(make("geometry_msgs/Twist", {"linear": {"x": 0.5}}))
    for scan in scans.take(N=10):
        stamp = scan.header.stamp.sec + scan.header.stamp.nanosec * 1e-9
        print("scan", f"{stamp:.3f}", scan.header.frame_id, len(scan.ranges), min(scan.ranges))
    for now in odometry.take(N=10):
        stamp = now.header.stamp.sec + now.header.stamp.nanosec * 1e-9
        print("odom", f"{stamp:.3f}", now.pose.pose.position.x, now.pose.pose.position.y)
"""
# Goes to a place on the map that comes to it, though it has joined later.
SENDER = HEAD + """
time.sleep(7)
maps = DataReader(participant, topic("map", "nav_msgs/OccupancyGrid"), qos=latched)
goals = DataWriter(participant, topic("goal_pose", "geometry_msgs/PoseStamped"), qos=default)
time.sleep(1)
(grid,) = maps.take(N=10)
print("map", grid.info.width * grid.info.height, len(grid.data), *sorted(set(grid.data)))
for frame, x in ("odom", 5.0), ("map", 1000.0), ("map", 23.0):
    goals.write(make("geometry_msgs/PoseStamped", {
        "header": {"frame_id": frame}, "pose": {"position": {"x": x, "y": 1.0}}}))
time.sleep(10)
now = odometry.take(N=1000)[-1].pose.pose.position
print("at", now.x, now.y)
"""
CHANGES = ("fleet.size=1", "fleet.start={poses: [{x: 20 m, y: 0 m}]}", "loop.dds_domain=3",
           "robot.odometry.position_noise=0 m")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    refuse_without_guest()
    return tmp_path_factory.mktemp("robot topics")


def play(folder, program, elapsed_s, *changes):
    return played(folder, f"stop: {{elapsed: {elapsed_s} s}}\n", [Program("robot_0", program)],
                  changes=(*CHANGES, *changes))


@pytest.fixture(scope="module")
def driven(folder):
    return play(folder, DRIVER, 6)


def lines(run, what):
    return [line.split()[1:] for line in said(run, "robot_0", 0) if line.startswith(what)]


def test_scans_and_odometry_come_at_their_rates_with_stamps_of_the_guests_clock(driven):
    scans, odometry = lines(driven, "scan"), lines(driven, "odom")
    assert {frame for _, frame, _, _ in scans} == {"robot_0/scan"}
    assert len(scans) > 100 and len(odometry) > 40
    for messages, hz in ((scans, 25), (odometry, 10)):
        times = [float(stamp) - 1_767_225_610 for stamp, *_ in messages]
        assert 0 < times[0] < times[-1] < 6
        assert (len(times) - 1) / (times[-1] - times[0]) == pytest.approx(hz, rel=0.02)


def test_velocities_move_the_robot_as_far_as_they_say(driven):
    """0.5 m/s for 3 s, less what acceleration takes."""
    times = {float(stamp): float(x) for stamp, x, _ in lines(driven, "odom")}
    assert times[min(times)] == pytest.approx(20.0)
    assert 1.2 < times[max(times)] - 20.0 < 1.6


def test_the_run_repeats(driven, folder):
    assert play(folder, DRIVER, 6).manifest["digest"] == driven.manifest["digest"]


def test_a_robot_without_its_bridge_does_not_move(folder):
    """The twin: in another domain nobody hears the program."""
    run = play(folder, DRIVER.replace('int(os.environ["ROS_DOMAIN_ID"])', "4"), 3)
    assert said(run, "robot_0", 0) == []


def test_programs_read_the_map_and_send_goals(folder):
    run = play(folder, SENDER, 19, "loop.navigation=true")
    ((cells, long, *values),) = lines(run, "map")
    assert cells == long and values == ["-1", "0", "100"]
    (x, y), = lines(run, "at")
    assert math.dist((float(x), float(y)), (23.0, 1.0)) < 0.4
    assert (run.path / "robot_0.ros2_bridge.log").read_text("utf-8").splitlines() == [
        "no goal: its frame is 'odom'; allowed: map", "no goal: 1000 1 is not on the map"]
