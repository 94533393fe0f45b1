"""The side of ``ros1_facade.py`` that speaks ROS 1: a program of rospy, which needs no desim.

    python3 ros1_bridge.py ROBOT

It publishes the lines that it reads as ROBOT/scan, ROBOT/odom and tf, and writes a line for each
message of ROBOT/cmd_vel.
"""

import json
import math
import os
import sys
import threading
import time

import rospy
from geometry_msgs.msg import Quaternion, TransformStamped, Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

COMMANDS = 1  # the descriptor of its standard output
QUEUE = 1  # of each topic: a slow subscriber gets the newest


class Bridge:
    """The topics of one robot."""

    def __init__(self, robot, begin):
        self._robot, self._begin = robot, begin
        self._scans = {}
        self._odom = self._topic("odom", Odometry)
        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=10, tcp_nodelay=True)
        rospy.Subscriber(f"/{robot}/cmd_vel", Twist, self._command, tcp_nodelay=True)

    def pass_on(self, line):
        """Publish what a line says."""
        what = json.loads(line)
        stamp = rospy.Time.from_sec(self._begin + what["stamp_ns"] / 1e9)
        if "scan" in what:
            self._scan(what, stamp)
        else:
            self._odometry(what["odom"], stamp)

    def _topic(self, name, kind):
        return rospy.Publisher(f"/{self._robot}/{name}", kind, queue_size=QUEUE, tcp_nodelay=True)

    def _scan(self, what, stamp):
        name = what["scan"]
        if name not in self._scans:
            self._scans[name] = self._topic(name, LaserScan)
        scan = LaserScan()
        scan.header.stamp, scan.header.frame_id = stamp, f"{self._robot}/{name}"
        scan.ranges, scan.range_max = what["ranges"], what["range_max"]
        scan.angle_min, scan.angle_increment = what["angle_min"], what["increment"]
        scan.angle_max = scan.angle_min + (len(scan.ranges) - 1) * scan.angle_increment
        self._scans[name].publish(scan)
        x, y = what["at"]
        self._transform(stamp, f"{self._robot}/base_link", scan.header.frame_id, (x, y, 0.0))

    def _odometry(self, pose, stamp):
        odometry = Odometry()
        odometry.header.stamp, odometry.header.frame_id = stamp, f"{self._robot}/odom"
        odometry.child_frame_id = f"{self._robot}/base_link"
        position = odometry.pose.pose.position
        position.x, position.y = pose[:2]
        odometry.pose.pose.orientation = turned(pose[2])
        self._odom.publish(odometry)
        self._transform(stamp, f"{self._robot}/odom", odometry.child_frame_id, pose)

    def _transform(self, stamp, parent, child, pose):
        transform = TransformStamped()
        transform.header.stamp, transform.header.frame_id = stamp, parent
        transform.child_frame_id = child
        transform.transform.translation.x, transform.transform.translation.y = pose[:2]
        transform.transform.rotation = turned(pose[2])
        self._tf.publish(TFMessage([transform]))

    def _command(self, velocity):
        line = f"{velocity.linear.x} {velocity.linear.y} {velocity.angular.z}\n"
        os.write(COMMANDS, line.encode())


def turned(yaw):
    """The quaternion of a turn around the vertical."""
    return Quaternion(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


class Joining(threading.Thread):
    """Joins ROS, which waits for the master. ``bridge`` is None until then."""

    def __init__(self, robot):
        super().__init__(daemon=True)
        self._robot, self._begin = robot, time.time()  # the simulation began just now
        self.bridge = None

    def run(self):
        rospy.init_node(f"{self._robot}_desim", disable_signals=True)
        self.bridge = Bridge(self._robot, self._begin)


def main():
    joining = Joining(sys.argv[1])
    joining.start()
    for line in sys.stdin:  # at once: desim waits for room in the pipe
        if joining.bridge is not None:
            joining.bridge.pass_on(line)


if __name__ == "__main__":
    main()
