"""Localization: nodes that turn a sensor's pose into the topic ``pose``."""

from __future__ import annotations

from desim.middleware.contents import Lazy
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node


class _Relay(Node):
    """Publishes each message of the topic ``source`` as ``pose``, without reading it."""

    source: str

    def __init__(self, host: Host) -> None:
        super().__init__(host, "localization")

    def start(self) -> None:
        self.advertise("pose")
        self.subscribe(self.source, self._on_pose)

    def _on_pose(self, message: Message) -> None:
        self.publish("pose", Lazy(message.size_bytes, lambda: message.content))


class GroundTruth(_Relay):
    """A sensor that knows the true pose."""

    source = "true_pose"


class OdometryLocalization(_Relay):
    """The odometry, believed as it is."""

    source = "odom"
