"""The bridge to ROS 2, a program of Cyclone DDS: ``python3 ros2_bridge.py ROBOT``. Needs no desim.

In the domain $ROS_DOMAIN_ID it publishes messages as rt/ROBOT/scan, rt/ROBOT/odom, rt/ROBOT/map and
rt/tf, and passes on those of rt/ROBOT/cmd_vel and rt/ROBOT/goal_pose.
"""

import os
from collections import defaultdict

import bridge
from cyclonedds.core import DDSException, Listener, Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from ros2_messages import kind, make

KINDS = defaultdict(lambda: "sensor_msgs/LaserScan", odom="nav_msgs/Odometry",
                    tf="tf2_msgs/TFMessage", map="nav_msgs/OccupancyGrid")  # by topic
XCDR1 = Policy.DataRepresentation(use_cdrv0_representation=True)  # the one that ROS 2 has
VOLATILE = XCDR1, Policy.Durability.Volatile
RELIABLE = Policy.Reliability.Reliable(0)  # a writer does not wait for room
# As nodes of ROS 2 have them: rmw_qos_profile_sensor_data, tf2_ros, nav2_map_server, and defaults.
QUALITIES = defaultdict(
    lambda: Qos(*VOLATILE, Policy.Reliability.BestEffort, Policy.History.KeepLast(5)),
    odom=Qos(*VOLATILE, RELIABLE, Policy.History.KeepLast(10)),
    tf=Qos(*VOLATILE, RELIABLE, Policy.History.KeepLast(100)),
    map=Qos(XCDR1, Policy.Durability.TransientLocal, RELIABLE, Policy.History.KeepLast(1)))


class Ros2Robot:
    """The topics of one robot: a writer for each that it publishes, and readers."""

    def __init__(self, robot):
        self._robot, self._writers = robot, {}
        # By that name rmw finds the participants of ROS.
        self._participant = DomainParticipant(int(os.environ.get("ROS_DOMAIN_ID", 0)),
                                              qos=Qos(Policy.Userdata(b"enclave=/;")))
        self._readers = [self._reader("cmd_vel", "geometry_msgs/Twist", bridge.command),
                         self._reader("goal_pose", "geometry_msgs/PoseStamped", bridge.send_to)]
        for topic in "odom", "tf":
            self._writer(topic)

    def publish(self, topic, fields):
        """Publish a message of these fields."""
        message = make(KINDS[topic], {"transforms": [
            make("geometry_msgs/TransformStamped", fields)]} if topic == "tf" else fields)
        try:
            self._writer(topic).write(message)
        except DDSException as error:  # what was sent before has not been acknowledged
            bridge.say(f"{topic}: {error}")

    def _writer(self, topic):
        if topic not in self._writers:
            self._writers[topic] = DataWriter(
                self._participant, self._topic(topic, KINDS[topic]), qos=QUALITIES[topic])
        return self._writers[topic]

    def _reader(self, topic, message, pass_on):
        return DataReader(self._participant, self._topic(topic, message), qos=QUALITIES["odom"],
                          listener=Passing(pass_on))

    def _topic(self, name, message):
        in_namespace = name if name == "tf" else f"{self._robot}/{name}"
        return Topic(self._participant, f"rt/{in_namespace}", kind(message))


class Passing(Listener):
    """Passes on each message that arrives."""

    def __init__(self, pass_on):
        super().__init__()
        self._pass_on = pass_on

    def on_data_available(self, reader):
        for message in reader.take(N=100):
            if isinstance(message, IdlStruct):  # else: its writer is gone
                self._pass_on(message)


def join(robot):
    """Join ROS 2. Returns the function that publishes."""
    return Ros2Robot(robot).publish


if __name__ == "__main__":
    bridge.serve(join)
