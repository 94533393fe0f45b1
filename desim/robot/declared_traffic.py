"""Declared traffic: messages of a size at a rate, which no node reads (``robot.publishes``)."""

from __future__ import annotations

from collections.abc import Sequence

from desim.middleware.contents import Filler
from desim.middleware.host import Host
from desim.middleware.node import Node
from desim.scenario.schema.robot import Publication


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
    """Subscribes to ``topics``, and does nothing with what arrives."""

    def __init__(self, host: Host, topics: Sequence[str]) -> None:
        super().__init__(host, "listener")
        self._topics = tuple(topics)

    def start(self) -> None:
        for topic in self._topics:
            self.latest(topic)
