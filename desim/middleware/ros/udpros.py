"""UDPROS at the publisher: datagrams to all that have asked for them, for ever."""

from __future__ import annotations

from desim.middleware.ros.client import RosPublication
from desim.middleware.ros.links import RosLink
from desim.ports.middleware import Published, Transport


class Udpros:
    """Sends ``datagrams`` to the subscribers of ``publication``. The publisher never learns that a
    subscriber is gone. One that asks again is a new receiver."""

    def __init__(self, datagrams: Transport, publication: RosPublication) -> None:
        self._datagrams = datagrams
        self._publication = publication
        self._asked: dict[int, RosLink] = {}

    def connect(self, receivers: list[int]) -> list[int]:
        links = self._publication.links
        asked = {receiver: links[receiver] for receiver in receivers}
        self._datagrams.connect([receiver for receiver in receivers
                                 if self._asked.get(receiver) is asked[receiver]])
        self._asked = asked
        return self._datagrams.connect(receivers)

    def send(self, message: Published, only: list[int] | None = None) -> None:
        self._datagrams.send(message, only)

    def close(self, reason: str) -> None:
        self._datagrams.close(reason)

    def waiting(self) -> int:
        return self._datagrams.waiting()
