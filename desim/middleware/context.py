"""The graph as its middleware sees it (``ports.middleware.MiddlewareContext``).

It keeps the account of all that passes between the two.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cache, partial
from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np

from desim.engine.agenda import Call
from desim.engine.kernel import Phase
from desim.engine.trace import pack
from desim.middleware.answer_checks import transport_of
from desim.middleware.arp import Neighbours
from desim.middleware.beliefs import Beliefs
from desim.middleware.datagrams import Datagram
from desim.middleware.transports import Stream
from desim.network.carrier import BEFORE_NS, Carrier
from desim.ports import TimePart
from desim.ports.middleware import (
    Addressing,
    Advertisement,
    CarriesMessages,
    DatagramSocket,
    Endpoint,
    HostState,
    InAdvance,
    Informs,
    Middleware,
    Published,
    Sends,
    Transport,
    TransportKind,
)

if TYPE_CHECKING:
    from desim.middleware.graph import Graph
    from desim.middleware.udp.socket import UdpSocket
    from desim.network.medium import Medium
    from desim.network.ways import Way

ACKS = "ack"  # the kind of TCP's acknowledgements, of which those of messages are no discovery


class GraphContext:
    """The ``MiddlewareContext`` of one ``Graph``. ``discovery_bytes`` are those of the middleware's
    own frames by kind, with all headers; ``discovery_frames`` are their numbers.

    Each of these frames is a trace row ``control`` (entity: the source; a: the receiver, or the
    medium of a multicast; b: the kind; c: its bytes). A lost one leaves no other row: it is in the
    medium's account. The functions in ``watchers`` are called with each host that starts or stops.
    """

    def __init__(self, graph: Graph, middleware: Middleware) -> None:
        self._graph = graph
        self._middleware = middleware
        self.transport: Callable[[Advertisement], Transport] = (
            partial(transport_of, middleware) if isinstance(middleware, CarriesMessages)
            else self.default_transport)
        self.hosts = tuple(host.name for host in graph.hosts)
        self.host_ids = tuple(host.id for host in graph.hosts)
        self.kernel = graph.kernel
        self.discovery_bytes: dict[str, int] = {}
        self.discovery_frames: dict[str, int] = {}
        self.beliefs = Beliefs(middleware.informed, self.record, list(self.host_ids),
                               graph.names.id, graph.domains) \
            if isinstance(middleware, Informs) else None
        self._neighbours: Neighbours | None = None
        self.watchers: list[Callable[[int, bool], object]] = []
        self.changed = graph.changed
        self.up = graph.up.__getitem__
        self._starts = [0] * len(self.hosts)
        self.life = self._starts.__getitem__
        self.deliver, self.drop, self.repeat = graph.deliver, graph.drop, graph.repeat
        self.record_frame = graph.record_frame
        self._id = cache(graph.names.id)
        self._control = self._id("control")

    # Events of the graph.

    def started(self, host: int) -> None:
        self._starts[host] += 1
        for watcher in self.watchers:
            watcher(host, True)
        self._middleware.switched(host, True)

    def stopped(self, host: int) -> None:
        if self.beliefs is not None:
            self.beliefs.stops(host)
        for watcher in self.watchers:
            watcher(host, False)
        self._middleware.switched(host, False)

    def hangs_on(self, medium: Medium, host: int, access_point: str | None) -> None:
        """``host`` has come to an access point of ``medium``, or left it (None)."""
        if access_point is None and self._neighbours is not None:
            self._neighbours.lose_carrier(medium, host)

    def advertised(self, advertised: Advertisement) -> None:
        if self.beliefs is not None:
            self.beliefs.advertises(advertised.publisher.host, advertised.publisher.topic)
        self._middleware.advertise(advertised)

    def subscribed(self, subscriber: Endpoint) -> None:
        if self.beliefs is not None:
            self.beliefs.subscribes(subscriber.host, subscriber.topic)
        self._middleware.subscribe(subscriber)

    # The port: see ``MiddlewareContext``.

    now_ns = property(attrgetter("kernel.now_ns"))

    def at(self, time_ns: int, host: int, fn: Callable[..., object], arg: object = None) -> Call:
        return self.kernel.at(time_ns, Phase.NETWORK, self.host_ids[host], fn, arg)

    def stream(self, *name: str | int) -> np.random.Generator:
        return self._graph.streams("middleware", *name)

    def knows(self, believer: int, other: int, topic: str, holds: bool) -> None:
        if self.beliefs is not None:
            self.beliefs.knows(believer, other, topic, holds)

    def sees(self, believer: int, other: int, state: HostState) -> None:
        if self.beliefs is not None:
            self.beliefs.sees(believer, other, state)

    def default_transport(self, advertised: Advertisement) -> Transport:
        host = self._graph.hosts[advertised.publisher.host]
        if (advertised.transport, advertised.via) == (TransportKind.STREAM, Addressing.UNICAST):
            return Stream(host, advertised.queue, advertised.publisher.topic)
        return Datagram(host, advertised.via == Addressing.BROADCAST, advertised.publisher.topic,
                        advertised.publisher.node)

    def route(self, source: int, receiver: int, topic: str = "") -> Medium | Way | None:
        return self._graph.routes.of(self._graph.hosts[source], receiver, topic)

    def frames(self, source: int, receivers: Iterable[int], topic: str, multicast: bool
               ) -> tuple[list[tuple[Medium | Way, tuple[int, ...]]], list[int]]:
        return self._graph.routes.frames(self._graph.hosts[source], receivers, topic, multicast)

    def resolve_addresses(self, tick_ns: int) -> Neighbours:
        self._neighbours = Neighbours(self, tick_ns, self._graph.passages)
        return self._neighbours

    def record(self, kind: str, host: int, a: int = 0, b: int = 0, c: int = 0) -> None:
        graph = self._graph
        graph.put(pack(self.kernel.now_ns, self._id(kind), self.host_ids[host], a, b, c))

    def relay(self, message: Published, host: int) -> None:
        if self._graph.passages is not None:
            self._graph.passages.relay(message, host, self.kernel.now_ns)

    def record_loss(self, source: int, receiver: int, seq: int, reason: str) -> None:
        graph, ids = self._graph, self.host_ids
        graph.put(pack(self.kernel.now_ns, graph.LOST, ids[receiver], ids[source], seq,
                       self._id(reason)))

    def record_control(self, kind: str, source: int, to: int, size_bytes: int) -> None:
        self._count(kind, size_bytes)
        graph = self._graph
        graph.trace.row(self.kernel.now_ns, self._control, self.host_ids[source], to,
                        self._id(kind), size_bytes)

    def send(self, kind: str, source: int, receivers: Sequence[int], size_bytes: int,
             arrived: Callable[..., object], token: object = None, *, segments: int = 1,
             multicast: bool = False, in_part: Callable[..., object] | None = None,
             in_advance: Callable[[int], InAdvance | None] | None = None,
             socket: DatagramSocket | None = None) -> None:
        graph, ids = self._graph, self.host_ids
        frames, _ = self.frames(source, sorted(receivers), "", multicast)
        carrier = _Arrivals(arrived, in_part, socket or "discovery")
        if segments > 1 or multicast or self._neighbours is not None:
            in_advance = None
        now_ns, own, kind_id = self.kernel.now_ns, ids[source], self._id(kind)
        self._count(kind, size_bytes, len(frames))
        for medium, to in frames:
            to_id = medium.id if multicast else ids[to[0]]
            graph.put(pack(now_ns, self._control, own, to_id, kind_id, size_bytes))
            note = None if in_advance is None else in_advance(to[0])
            if note is None:
                sends = medium if self._neighbours is None or multicast \
                    else self.way(medium, source, to)
                if socket is None:
                    sends.transmit(source, to, size_bytes, segments, multicast, carrier, token)
                else:
                    socket.send(medium, to, size_bytes, segments, multicast, carrier, token,
                                sends=sends)
                continue
            arrival_ns = medium.post(source, (to[0],), size_bytes, carrier, token)
            if arrival_ns is not None:
                note(arrival_ns, arrived, token)
        graph.trace.flush_if_full()

    def way(self, medium: Medium | Way, source: int, receivers: Sequence[int]
            ) -> Sends:
        """The next stop of a datagram of ``source``: one for a single host needs its address."""
        if self._neighbours is None or len(receivers) > 1:
            return medium
        return self._neighbours.of(medium, source, receivers[0])

    def socket(self, host: int, name: str) -> UdpSocket:
        return self._graph.hosts[host].sockets.named(name)

    def block(self, host: int, node: str) -> None:
        self._graph.hosts[host].sockets.block(node)

    def unblock(self, host: int, node: str) -> None:
        self._graph.hosts[host].sockets.unblock(node)

    def waited(self, since_ns: int) -> None:
        if self._graph.passages is not None:
            self._graph.passages.waited(TimePart.SENDER, since_ns)

    def _count(self, kind: str, size_bytes: int, frames: int = 1) -> None:
        """Count so many frames of one size."""
        if frames:
            self.discovery_bytes[kind] = self.discovery_bytes.get(kind, 0) + frames * size_bytes
            self.discovery_frames[kind] = self.discovery_frames.get(kind, 0) + frames


class _Arrivals(Carrier[object]):
    """The carrier of frames of which only the arrival matters. A protocol over UDP takes a copy
    for another frame."""

    __slots__ = ("arrived", "repeated", "socket", "_in_part")
    arrived: Callable[..., object]
    repeated: Callable[..., object]
    socket: object

    def __init__(self, arrived: Callable[..., object], in_part: Callable[..., object] | None,
                 socket: object) -> None:
        self.arrived = self.repeated = arrived
        self._in_part, self.socket = in_part, socket

    def first_sent(self, token: object, now_ns: int) -> int:
        return BEFORE_NS

    def arrived_in_part(self, token: object, receiver: int, lost: dict[int, str]) -> None:
        """A datagram is lost with any packet of it, unless the frame is a train of several."""
        if self._in_part is not None:
            self._in_part(token, receiver, lost)
