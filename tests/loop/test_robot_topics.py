"""Robots as programs of ROS see them, in the guest. Skipped where that or their ROS is missing."""

from __future__ import annotations

import math
import subprocess

import pytest
from loop_guests import Program, played, refuse_without_guest, said

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
ROBOT = ("fleet.size=1", "fleet.start={poses: [{x: 20 m, y: 0 m}]}",
         "robot.odometry.position_noise=0 m")


# The same with rospy, on the master of the first program.
MASTER = "import os\nos.execvp('rosmaster', ['rosmaster', '--core'])\n"
ROSPY = """
import os, sys
if sys.executable != "/usr/bin/python3":  # desim's own, which started this
    os.execv("/usr/bin/python3", ["/usr/bin/python3", *sys.argv])
import rospy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import OccupancyGrid, Odometry

rospy.init_node("sender")
goals = rospy.Publisher("move_base_simple/goal", PoseStamped, queue_size=1)
rospy.sleep(7)
grid = rospy.wait_for_message("map", OccupancyGrid, 1)
print("map", grid.info.width * grid.info.height, len(grid.data), *sorted(set(grid.data)))
goal = PoseStamped()
goal.header.frame_id, goal.pose.position.x, goal.pose.position.y = "map", 23.0, 1.0
goals.publish(goal)
rospy.sleep(10)
now = rospy.wait_for_message("odom", Odometry).pose.pose.position
print("at", now.x, now.y)
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    refuse_without_guest()
    return tmp_path_factory.mktemp("robot topics")


def play(folder, program, elapsed_s, *changes):
    pytest.importorskip("cyclonedds", reason="pip install 'desim[loop]'")
    return played(folder, f"stop: {{elapsed: {elapsed_s} s}}\n", [Program("robot_0", program)],
                  changes=(*ROBOT, "loop.dds_domain=3", *changes))


@pytest.fixture(scope="module")
def driven(folder):
    return play(folder, DRIVER, 6)


def lines(run, what, number=0):
    return [line.split()[1:] for line in said(run, "robot_0", number) if line.startswith(what)]


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


def test_stamps_go_on_when_the_robot_was_down(folder):
    run = play(folder, DRIVER, 5, "faults=[{at: 2 s, host: robot_0, down_for: 1 s}]")
    times = [float(stamp) - 1_767_225_610 for stamp, *_ in lines(run, "scan")]
    assert times == sorted(times)
    assert not any(2.0 < time < 3.0 for time in times) and 4.5 < times[-1] <= 5.0


def refuse_without_rospy():
    tried = subprocess.run(
        ["/usr/bin/python3", "-c", "import rospy, rosmaster, nav_msgs, tf2_msgs"],
        capture_output=True, text=True, check=False)
    if tried.returncode:
        pytest.skip(tried.stderr.strip().rpartition("\n")[2])


def has_arrived(run, number):
    """Whether the program has read the map, and the robot is where it was sent."""
    ((cells, known, *values),) = lines(run, "map", number)
    ((x, y),) = lines(run, "at", number)
    return (cells == known and values == ["-1", "0", "100"]
            and math.dist((float(x), float(y)), (23.0, 1.0)) < 0.4)


def test_programs_read_the_map_and_send_goals(folder):
    run = play(folder, SENDER, 19, "loop.navigation=true")
    assert has_arrived(run, 0)
    assert (run.path / "robot_0.ros2_bridge.log").read_text("utf-8").splitlines() == [
        "no goal: its frame is 'odom'; allowed: map", "no goal 1000 1: not on the map"]
    assert run.manifest["loop"]["refused_goals"] == {"robot_0": {"not on the map": 1}}


def test_goals_for_a_robot_that_does_not_navigate_are_refused(folder):
    sender = HEAD + """
time.sleep(3)
goals = DataWriter(participant, topic("goal_pose", "geometry_msgs/PoseStamped"), qos=default)
time.sleep(1)
goals.write(make("geometry_msgs/PoseStamped", {"header": {"frame_id": "map"}}))
time.sleep(9)
"""
    run = play(folder, sender, 6)
    assert run.manifest["loop"]["refused_goals"] == {"robot_0": {"loop.navigation is false": 1}}


def test_so_do_those_of_ros_1(folder):
    refuse_without_rospy()
    run = played(folder, "stop: {elapsed: 20 s}\n",
                 [Program("robot_0", MASTER), Program("robot_0", ROSPY)],
                 changes=(*ROBOT, "loop.ros_master=robot_0", "loop.navigation=true"))
    assert has_arrived(run, 1)
