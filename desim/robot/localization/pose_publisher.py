"""The pose of a robot whose localization takes time, by a transform of the odometry as with tf.

Localization publishes the transform ``map -> odom`` when the time of its callback is over. The pose
is this transform applied to the odometry, which arrives at its usual rate. While SLAM is busy with
a scan, the pose follows the odometry from the last correction on.
"""

from __future__ import annotations

from typing import NamedTuple

from desim.middleware.contents import (
    MAP_FRAME_BYTES,
    ODOM_FRAME_BYTES,
    Pose,
    tf_message_bytes,
)
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node
from desim.middleware.topics import PolledSubscription
from desim.ports import Pose2D
from desim.robot.localization.node import LocalizationNode, publish_pose
from desim.robot.transforms import motion_to, moved

_TOPIC = "map_to_odom"
_TRANSFORM_BYTES = tf_message_bytes(MAP_FRAME_BYTES, ODOM_FRAME_BYTES)
_ORIGIN = Pose2D(0.0, 0.0, 0.0)


class Correction(NamedTuple):
    """The transform ``map -> odom``."""

    transform: Pose2D

    @property
    def size_bytes(self) -> int:
        return _TRANSFORM_BYTES


class CorrectionNode(LocalizationNode):
    """Publishes the correction of odometry instead of the pose."""

    _topic = _TOPIC

    def _publish(self, before: Pose | None, odometry: Pose, pose: Pose2D) -> None:
        self.publish(_TOPIC, Correction(moved(pose, motion_to(Pose2D(*odometry[1:]), _ORIGIN))))


class PosePublisher(Node):
    """Publishes ``pose`` for each message of ``odom``: the odometry, transformed by the last
    correction that has arrived."""

    def __init__(self, host: Host) -> None:
        super().__init__(host, "pose_publisher")
        self._correction: PolledSubscription
        self._odometry: Pose | None = None  # the latest

    def start(self) -> None:
        self.advertise("pose")
        self._correction = self.latest(_TOPIC)
        self.subscribe("odom", self._on_odometry)

    def _on_odometry(self, message: Message) -> None:
        before, odometry = self._odometry, message.content
        correction = self._correction.read()
        if correction is None:
            return
        self._odometry = odometry
        pose = moved(correction.content.transform, Pose2D(*odometry[1:]))
        publish_pose(self, before, odometry.stamp_ns, pose)
