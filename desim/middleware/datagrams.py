"""The transport ``Datagram``: UDPROS-like, fire and forget."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from desim.middleware.headers import datagram_frame
from desim.network.carrier import Carrier

if TYPE_CHECKING:
    from desim.middleware.host import Host
    from desim.middleware.message import Message
    from desim.network.medium import Medium
    from desim.network.ways import Way


class Datagram(Carrier["Message"]):
    """Fire and forget: a frame per receiving host, or one broadcast frame per medium. Any lost
    datagram of a message loses the message."""

    __slots__ = ("_graph", "_source", "_topic", "_broadcast", "_routes", "_known", "_unrouted",
                 "_flying", "_udp", "_node")

    def __init__(self, source: Host, broadcast: bool, topic: str = "", node: str | None = None
                 ) -> None:
        self._graph = source.graph
        self._source, self._topic = source, topic
        self._udp, self._node = source.sockets.new(), node
        self._broadcast = broadcast
        self._routes: list[tuple[Medium | Way, tuple[int, ...]]] = []
        self._known: list[int] = []
        self._unrouted: list[int] = []
        self._flying = 0

    def connect(self, receivers: list[int]) -> list[int]:
        """Send to ``receivers`` from now on. Returns the new ones among those that have a way."""
        self._routes, self._unrouted = self._graph.routes.frames(
            self._source, receivers, self._topic, self._broadcast)
        old = self._known
        self._known = [receiver for _, group in self._routes for receiver in group]
        return [receiver for receiver in self._known if receiver not in old]

    def send(self, message: Message, only: list[int] | None = None) -> None:
        routes, unrouted = self._routes, self._unrouted
        if only is not None:
            kept = [(medium, [receiver for receiver in group if receiver in only])
                    for medium, group in routes]
            routes, unrouted = [(medium, tuple(group)) for medium, group in kept if group], []
        graph, source = self._graph, self._source
        size_bytes, segments = datagram_frame(message.size_bytes)
        for medium, group in routes:
            to = medium.id if self._broadcast else graph.hosts[group[0]].id
            graph.trace.row(graph.kernel.now_ns, graph.FRAME, source.id, to, message.seq,
                            size_bytes)
            self._flying += len(group)
            sends = medium if self._broadcast else graph.context.way(medium, source.index, group)
            self._udp.send(medium, group, size_bytes, segments, self._broadcast, self, message,
                           node=self._node, sends=sends)
        for receiver in unrouted:
            graph.drop(message, receiver, "no_route")

    def topics(self, message: Message) -> tuple[str, ...]:
        return (message.topic,)

    def arrived(self, message: Message, receiver: int) -> None:
        self._flying -= 1
        self._graph.deliver(message, receiver, message.born_ns, message.born_ns)

    def arrived_many(self, message: Message, receivers: Sequence[int]) -> None:
        self._flying -= len(receivers)
        self._graph.deliver_all(message, receivers)

    def arrived_in_part(self, message: Message, receiver: int, lost: dict[int, str]) -> None:
        self.lost(message, receiver, next(iter(lost.values())))

    def lost(self, message: Message, receiver: int, reason: str) -> None:
        self._flying -= 1
        self._graph.drop(message, receiver, reason, message.born_ns, message.born_ns)

    def repeated(self, message: Message, receiver: int) -> None:
        """UDP does not recognise copies: the message arrives again."""
        self._graph.repeat(message, receiver)
        self._graph.hosts[receiver].receive(message)

    def missed(self, message: Message, receivers: Collection[int], reason: str,
               medium: Medium) -> None:
        """A broadcast did not reach several hosts: one row of the medium's for all of them."""
        self._flying -= len(receivers)
        self._graph.miss(message, receivers, reason, medium)

    def close(self, reason: str) -> None:
        """Nothing waits here, and frames on their way go on."""
        self._routes, self._known, self._unrouted = [], [], []

    def waiting(self) -> int:
        """Receptions under way."""
        return self._flying
