"""tf as traffic: the transforms between frames that ROS nodes publish, which no node here reads.

On the paper's robots four messages of one transform each are published ten times a second. The
simulator publishes odom to base_footprint, with each odometry reading; gmapping publishes map to
odom; publishers of static transforms publish two constant ones. All robots share one topic, unless
something like yzrobot's tf_splitter gives each robot its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import partial
from typing import Literal, NamedTuple

from desim.middleware.contents import (
    BASE_FRAME_BYTES,
    BASE_LINK_FRAME_BYTES,
    LASER_FRAME_BYTES,
    MAP_FRAME_BYTES,
    ODOM_FRAME_BYTES,
    Filler,
    tf_message_bytes,
)
from desim.middleware.host import Host
from desim.middleware.node import Node
from desim.robot.declared_traffic import with_copies

_QUEUE = 100  # of tf's broadcaster and listener
_RATE_HZ = 10  # gmapping's transform_publish_period in the paper's launch file: 0.1 s

ODOMETRY_BYTES = tf_message_bytes(ODOM_FRAME_BYTES, BASE_FRAME_BYTES)
ROBOT_BYTES = (tf_message_bytes(MAP_FRAME_BYTES, ODOM_FRAME_BYTES),
               tf_message_bytes(BASE_FRAME_BYTES, BASE_LINK_FRAME_BYTES),
               tf_message_bytes(BASE_LINK_FRAME_BYTES, LASER_FRAME_BYTES))

Audience = Literal["own", "all"]


class Sent(NamedTuple):
    """Messages of ``size_bytes`` on ``topic``. ``start`` as ``Node.timer`` takes it."""

    topic: str
    size_bytes: int
    rate_hz: Fraction
    start: str


def topic_of(robot: str, audience: Audience) -> str:
    """The topic that a robot's transforms are published on."""
    return "/tf" if audience == "all" else f"/{robot}/tf"


def of_odometry(robots: Sequence[str], rate_hz: Fraction, audience: Audience) -> list[Sent]:
    """The transforms that come with the odometry of ``robots``, all at once."""
    return [Sent(topic_of(robot, audience), ODOMETRY_BYTES, rate_hz, "zero") for robot in robots]


def of_software(robot: str, audience: Audience, lasers: int) -> list[Sent]:
    """The transforms that the software of a robot with so many ``lasers`` publishes."""
    return [Sent(topic_of(robot, audience), size_bytes, Fraction(_RATE_HZ), "random")
            for size_bytes in (*ROBOT_BYTES, *ROBOT_BYTES[-1:] * (lasers - 1))]


class TransformBroadcaster(Node):
    """Publishes messages of tf, a copy for each of ``processes`` processes on a receiving host.
    ``listens``: the topic of tf to which it subscribes, or None."""

    def __init__(self, host: Host, name: str, sent: Sequence[Sent], listens: str | None,
                 processes: int = 1) -> None:
        super().__init__(host, name)
        self._sent, self._listens, self._processes = tuple(sent), listens, processes

    def start(self) -> None:
        for topic in dict.fromkeys(one.topic for one in self._sent):
            for copy in with_copies(topic, self._processes):
                self.advertise(copy, queue=_QUEUE)
        for topic in with_copies(self._listens, self._processes) if self._listens else ():
            self.latest(topic)
        for one in self._sent:
            self.timer(one.rate_hz, partial(self._publish, one), one.start, name="tf")

    def _publish(self, sent: Sent, _: int) -> None:
        for topic in with_copies(sent.topic, self._processes):
            self.publish(topic, Filler(sent.size_bytes))
