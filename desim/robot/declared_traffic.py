"""Declared traffic: messages of a size at a rate, which no node reads.

It has two sources: ``robot.publishes``, the traffic that a scenario adds to a robot; and
``testbed.processes``, where several processes of a computer subscribe to a topic, and each gets a
copy of its messages over the network.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import partial
from typing import NamedTuple

from desim.middleware.batches.publisher import BatchPublisher
from desim.middleware.contents import Filler
from desim.middleware.host import Host
from desim.middleware.node import Node
from desim.scenario.schema.robot import Publication

_SPINS_HZ = 10


class PeriodicPublisher(Node):
    """Publishes the messages of one ``publication``."""

    def __init__(self, host: Host, publication: Publication) -> None:
        super().__init__(host, f"{publication.topic}_publisher".replace("/", "_"))
        self._publication = publication

    def start(self) -> None:
        own = self._publication
        self.advertise(own.topic, transport=own.transport, queue=own.queue)
        self.timer(own.rate_hz, self._publish)

    def _publish(self, _: int) -> None:
        own = self._publication
        self.publish(own.topic, Filler(own.size_bytes))


class PassiveListener(Node):
    """Subscribes to ``topics``, and takes what arrives out of its sockets ten times a second.

    On a computer that gets busy that costs the time of all these receptions, which a real process
    would spend at each message."""

    def __init__(self, host: Host, topics: Sequence[str]) -> None:
        super().__init__(host, "listener")
        self._topics = tuple(topics)

    def start(self) -> None:
        for topic in self._topics:
            self.latest(topic)
        self.timer(_SPINS_HZ, lambda _: None, "zero", "spin")


def with_copies(topic: str, processes: int) -> list[str]:
    """``topic``, and the topic of a copy for each further process on a host that subscribes."""
    return [topic, *(f"{topic}/copy_{number}" for number in range(2, processes + 1))]


class Copied(NamedTuple):
    """The messages of ``size_bytes`` of a sensor's driver, of which each of ``processes`` processes
    gets a copy."""

    topic: str
    size_bytes: int
    rate_hz: Fraction
    processes: int


class CopyPublisher(Node):
    """Publishes the copies of a driver's messages for all processes but the first, at the instants
    of the driver."""

    def __init__(self, host: Host, copied: Sequence[Copied]) -> None:
        super().__init__(host, "copies")
        self._copied = tuple(copied)

    def start(self) -> None:
        together: dict[tuple[Fraction, int], list[str]] = {}
        for topic, size_bytes, rate_hz, processes in self._copied:
            together.setdefault((rate_hz, size_bytes), []).extend(with_copies(topic, processes)[1:])
        for (rate_hz, size_bytes), topics in together.items():
            publisher = BatchPublisher([self.advertise(topic) for topic in topics], size_bytes)
            self.timer(rate_hz, partial(self._publish_all, publisher), "zero")

    def _publish_all(self, publisher: BatchPublisher, _: int) -> None:
        publisher.publish(lambda _: Filler(publisher.size_bytes))
