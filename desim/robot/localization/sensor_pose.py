"""The node that publishes the readings of a sensor as the robot's pose."""

from __future__ import annotations

from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.robot.localization.kinds.ground_truth import GroundTruth
from desim.robot.localization.kinds.odometry import DeadReckoning

# Sensors whose readings are believed as they are. No other kind gets at the true pose.
SENSORS: dict[type, str] = {GroundTruth: "true_pose", DeadReckoning: "odom"}


class SensorPose(Node):
    """Publishes each message of the topic ``source`` as ``pose``, without reading it."""

    def __init__(self, host: Host, source: str) -> None:
        super().__init__(host, "localization")
        self._source = source

    def start(self) -> None:
        self._pose = self.advertise("pose")
        self.subscribe(self._source, self._on_pose)

    def _on_pose(self, message: Message) -> None:
        self._pose.publish(message.unread)
