"""Drives its robot about: ahead where there is room, else it turns (ROS 2 by Cyclone DDS)."""

import math
import os
import time

from cyclonedds.core import Listener, Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from desim.loop.ros2_messages import kind, make

NEAR = 1.2  # m ahead at which it turns


def nearest(scan, from_angle, to_angle):
    """The shortest beam between two angles."""
    first = int((from_angle - scan.angle_min) / scan.angle_increment)
    last = int((to_angle - scan.angle_min) / scan.angle_increment)
    return min(scan.ranges[max(first, 0):last + 1], default=scan.range_max)


class Driving(Listener):
    """Answers each scan with a velocity."""

    def on_data_available(self, reader):
        for scan in reader.take(N=10):
            ahead = nearest(scan, -0.4, 0.4)
            left, right = nearest(scan, 0.4, math.pi / 2), nearest(scan, -math.pi / 2, -0.4)
            if ahead > NEAR:
                speed, turn = min(1.0, ahead - NEAR), 0.8 * (left - right) / (left + right)
            else:
                speed, turn = 0.0, 1.5 if left > right else -1.5
            motors.write(make("geometry_msgs/Twist",
                              {"linear": {"x": speed}, "angular": {"z": turn}}))


robot = os.environ["DESIM_HOST"]
participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
# As rclcpp has them: SensorDataQoS, and QoS(10).
sensor_data = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(5))
reliable = Qos(Policy.Reliability.Reliable(duration(milliseconds=100)), Policy.History.KeepLast(10))
motors = DataWriter(participant, Topic(participant, f"rt/{robot}/cmd_vel",
                                       kind("geometry_msgs/Twist")), qos=reliable)
scans = DataReader(participant, Topic(participant, f"rt/{robot}/scan",
                                      kind("sensor_msgs/LaserScan")), qos=sensor_data,
                   listener=Driving())
time.sleep(1e6)
