"""A reliable writer: what it says goes to each reader over a link of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from desim.middleware.dds.reliable import ReliableLink

if TYPE_CHECKING:
    from desim.middleware.dds.dds import Dds
    from desim.middleware.topics import Message
    from desim.ports.middleware import Offer


class Reliable:
    """One writer: a link for each host whose reader it has matched."""

    def __init__(self, dds: Dds, offer: Offer) -> None:
        self._dds, self._offer = dds, offer
        self._host, self._topic = offer.publisher.host, offer.publisher.topic
        self._links: dict[int, ReliableLink] = {}
        self._closed: list[ReliableLink] = []  # with frames that are still on their way
        self._unrouted: list[int] = []

    def connect(self, receivers: list[int]) -> list[int]:
        """New links are to participants that were not known before, a host's new life too."""
        graph, dds, old = self._dds.context.graph, self._dds, self._links
        self._links, self._unrouted = {}, []
        fresh = []
        for receiver in receivers:
            medium = graph.route(graph.hosts[self._host], receiver)
            if medium is None:
                self._unrouted.append(receiver)
                continue
            guid = dds.reader(self._host, receiver, self._topic)
            link = old.get(receiver)
            if link is None or link.guid != guid:
                link = ReliableLink(dds, self._offer, receiver, guid, medium)
                fresh.append(receiver)
            self._links[receiver] = link
        for receiver, link in old.items():
            if self._links.get(receiver) is not link:
                link.close("link_closed")
                self._closed.append(link)
        self._closed = [link for link in self._closed if link.waiting]
        return fresh

    def send(self, message: Message, only: list[int] | None = None) -> None:
        if only is not None:
            for receiver in only:
                self._links[receiver].offer(message)
            return
        for link in self._links.values():
            link.offer(message)
        for receiver in self._unrouted:
            self._dds.context.graph.drop(message, receiver, "no_route")

    def close(self, reason: str) -> None:
        for link in self._links.values():
            link.close(reason)
        self._links, self._unrouted = {}, []

    def waiting(self) -> int:
        return sum(link.waiting for link in (*self._links.values(), *self._closed))
