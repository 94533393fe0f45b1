"""The bridge to ROS 1, a program of rospy: ``python3 ros1_bridge.py ROBOT``. Needs no desim.

It publishes messages as ROBOT/scan, ROBOT/odom, ROBOT/map (latched) and /tf, and passes on those of
ROBOT/cmd_vel and ROBOT/move_base_simple/goal.
"""

from collections import defaultdict

import bridge
import genpy
import rospy
from geometry_msgs.msg import PoseStamped, TransformStamped, Twist
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

KINDS = defaultdict(lambda: LaserScan, odom=Odometry, map=OccupancyGrid, tf=TFMessage)  # by topic
QUEUES = defaultdict(lambda: 1, tf=10)  # a slow subscriber gets the newest


class Publishers(dict):
    """The publishers of one robot by topic; a new one for a topic that has none."""

    def __init__(self, robot):
        super().__init__()
        self._robot = robot

    def __missing__(self, topic):
        name = "/tf" if topic == "tf" else f"/{self._robot}/{topic}"
        self[topic] = rospy.Publisher(name, KINDS[topic], queue_size=QUEUES[topic],
                                      tcp_nodelay=True, latch=topic == "map")
        return self[topic]

    def publish(self, topic, fields):
        """Publish a message of these fields."""
        message = (TFMessage([filled(TransformStamped(), fields)]) if topic == "tf"
                   else filled(KINDS[topic](), fields))
        self[topic].publish(message)


def filled(message, fields):
    """``message`` with these fields; times are in ns."""
    for name, value in fields.items():
        old = getattr(message, name)
        if isinstance(value, dict):
            filled(old, value)
        elif isinstance(old, genpy.Time):
            old.secs, old.nsecs = divmod(value, 10**9)
        else:
            setattr(message, name, value)
    return message


def join(robot):
    """Join ROS, which waits for the master. Returns the function that publishes."""
    rospy.init_node(f"{robot}_desim", disable_signals=True)
    publishers = Publishers(robot)
    for topic in "odom", "tf":
        publishers[topic]
    rospy.Subscriber(f"/{robot}/cmd_vel", Twist, bridge.command, tcp_nodelay=True)
    rospy.Subscriber(f"/{robot}/move_base_simple/goal", PoseStamped, bridge.send_to,
                     tcp_nodelay=True)
    return publishers.publish


if __name__ == "__main__":
    bridge.serve(join)
