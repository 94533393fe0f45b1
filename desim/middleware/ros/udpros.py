"""UDPROS at the publisher: datagrams to whoever has asked for them, for ever."""

from __future__ import annotations

from desim.middleware.graph import Host
from desim.middleware.ros.client import Publication
from desim.middleware.transports import Datagram


class Udpros(Datagram):
    """Nobody tells the publisher that a subscriber is gone. One that asks again is new."""

    __slots__ = ("_publication", "_asked")

    def __init__(self, source: Host, publication: Publication) -> None:
        super().__init__(source, False)
        self._publication = publication
        self._asked: dict[int, object] = {}

    def connect(self, receivers: list[int]) -> list[int]:
        links = self._publication.links
        asked = {receiver: links[receiver] for receiver in receivers}
        super().connect([receiver for receiver in receivers
                         if self._asked.get(receiver) is asked[receiver]])
        self._asked = asked
        return super().connect(receivers)
