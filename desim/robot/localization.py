"""Localization: nodes that turn a sensor's pose into the topic ``pose``."""

from __future__ import annotations

from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node

# The topic that each kind of localization believes: of a sensor that knows the true pose, or of the
# odometer, as it is.
SOURCES = {"ground_truth": "true_pose", "odometry": "odom"}


class Localization(Node):
    """Publishes each message of the topic ``source`` as ``pose``, without reading it."""

    def __init__(self, host: Host, source: str) -> None:
        super().__init__(host, "localization")
        self._source = source

    def start(self) -> None:
        self.advertise("pose")
        self.subscribe(self._source, self._on_pose)

    def _on_pose(self, message: Message) -> None:
        self.publish("pose", message.unread)
