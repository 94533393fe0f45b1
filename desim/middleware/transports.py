"""The transport ``Stream`` (TCPROS-like).

A transport is one publisher's. It hands frames to media and hears from them, as their carrier,
what became of each. ``Stream`` simplifies TCP: the sender knows a frame's fate when the medium
settles it, with no acknowledgement on the air.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from desim.engine.kernel import Phase, pair
from desim.engine.trace import pack
from desim.middleware.headers import stream_frame
from desim.middleware.jiffies import TICK_NS, fires_ns
from desim.network.carrier import Carrier
from desim.network.ways import Way
from desim.ports import packet_sizes

if TYPE_CHECKING:
    from desim.middleware.host import Host
    from desim.middleware.message import Message
    from desim.middleware.topics import PolledSubscription
    from desim.network.medium import Medium
    from desim.ports.networks import Handle

RTO_MIN_NS = 200_000_000  # Linux TCP_RTO_MIN
RTO_MAX_NS = 120_000_000_000  # Linux TCP_RTO_MAX


class Link(Protocol):
    """The way of one publisher's messages to one receiver."""

    @property
    def offer(self) -> Callable[..., object]:
        """``offer(message)`` sends it, or lets it wait."""

    @property
    def waiting(self) -> int:
        """The number of messages without a fate."""

    def close(self, reason: str) -> object:
        """Drop all messages that wait, for ``reason``."""


L = TypeVar("L", bound=Link)


class LinkedTransport(Generic[L]):
    """The transport of a publisher that has a link of its own to each receiver. ``drop`` is that of
    ``MiddlewareContext``. ``link_to(receiver, link)`` is ``link`` where that still leads to
    ``receiver``, else a new link; None: there is no way."""

    def __init__(self, link_to: Callable[[int, L | None], L | None],
                 drop: Callable[..., object]) -> None:
        self._link_to, self._drop = link_to, drop
        self._links: dict[int, L] = {}
        self._unrouted: list[int] = []

    def connect(self, receivers: list[int]) -> list[int]:
        """Keep, open and close links so that they lead to ``receivers``. Returns the new ones."""
        old, self._links, self._unrouted = self._links, {}, []
        for receiver in receivers:
            link = self._link_to(receiver, old.get(receiver))
            if link is None:
                self._unrouted.append(receiver)
            else:
                self._links[receiver] = link
        for receiver, link in old.items():
            if self._links.get(receiver) is not link:
                link.close("link_closed")
        return [receiver for receiver, link in self._links.items() if old.get(receiver) is not link]

    def links(self) -> dict[int, L]:
        """The links by receiver, for batches; none if there is no way to one of them."""
        return {} if self._unrouted else self._links

    def sender(self) -> Callable[[Message], object]:
        """A function that sends a message to all receivers of now: ``send``, or if there is but one
        link, what that does."""
        (link, *others) = self._links.values() or (None,)
        return self.send if link is None or others or self._unrouted else link.offer

    def send(self, message: Message, only: list[int] | None = None) -> None:
        for receiver in self._links if only is None else only:
            self._links[receiver].offer(message)
        if only is None:
            for receiver in self._unrouted:
                self._drop(message, receiver, "no_route")

    def close(self, reason: str) -> None:
        for link in self._links.values():
            link.close(reason)
        self._links, self._unrouted = {}, []

    def waiting(self) -> int:
        """Messages in outboxes and on the wire."""
        return sum([link.waiting for link in self._links.values()])


class Stream(LinkedTransport["StreamLink"]):
    """In order and reliable."""

    def __init__(self, source: Host, limit: int, topic: str = "") -> None:
        graph = source.graph

        def link_to(receiver: int, link: StreamLink | None) -> StreamLink | None:
            medium = graph.routes.of(source, receiver, topic)
            return None if medium is None else link or StreamLink(
                source, graph.hosts[receiver], medium, limit)

        super().__init__(link_to, graph.drop)


class StreamLink(Carrier["Message"]):
    """One message on the wire; an outbox behind it that drops its oldest when full.

    Segments that are lost while later ones arrive are sent again as soon as the sender can know it
    (TCP's selective acknowledgements say which), those at the end of a train after Linux's tail
    loss probe. A train that is lost whole is sent again after the probe, and then at the
    retransmission timeout, which doubles from 0.2 s and a round trip to 120 s and starts anew when
    a frame arrives. After an outage the link resumes at its next timeout. The round trip is
    estimated as twice the shortest frame delay.

    Segments that the sender's own interface refuses are not lost: they stay in the socket, and go
    when the next train of this host has left, or after 0.2 s (Linux: TCP small queues,
    ``tcp_check_probe_timer``).
    """

    protocol = "tcp"
    __slots__ = ("medium", "_graph", "_from", "_from_id", "_host", "_to", "_to_id", "_flights",
                 "_send", "_record_loss", "_limit", "_outbox", "_wire", "_train", "_trip_ns",
                 "_tries", "_first_ns", "_sent_ns", "_timer", "_closed", "_entity", "ahead",
                 "_latest", "_refused")

    def __init__(self, source: Host, destination: Host, medium: Medium | Way, limit: int) -> None:
        self._graph = source.graph
        self._from, self._from_id = source.index, source.id
        self._host = destination
        self._to, self._to_id = (destination.index,), destination.id
        # Over a way that may change, nothing is expected ahead of time.
        self._flights = None if isinstance(medium, Way) else medium.flights
        self.medium, self._send = medium, medium.transmit
        self._record_loss = source.graph.context.record_loss
        self._refused = source.refused
        self._limit = limit
        self._outbox: deque[Message] = deque()
        self._wire: Message | None = None
        self._train = 0, 0  # bytes and segments of it that are to be there yet
        self._trip_ns = -1  # the shortest one; -1: none has been measured
        self._tries = 0  # since something arrived
        self._first_ns = self._sent_ns = 0
        self._timer: Handle | None = None
        self._closed: str | None = None
        self._entity = pair(source.id, destination.id)
        self.ahead = self._flights is not None
        self._latest: PolledSubscription | None = None  # expects the message on the wire

    # For batches.

    @property
    def at_rest(self) -> bool:
        """Whether a message would leave at once, and nothing but its arrival would follow. If so,
        batches may send in the link's stead."""
        if self._latest is not None:
            self._latest.catch_up()
        return self._wire is None

    def take(self, message: Message) -> None:
        """Take over ``message``, which was sent at its birth in the link's stead."""
        self._wire = message
        self._train = stream_frame(message.size_bytes)
        self._first_ns = self._sent_ns = message.born_ns

    def offer(self, message: Message) -> None:
        if self._latest is not None:
            self._latest.catch_up()
        if self._wire is None:
            graph, send = self._graph, self._send
            put = graph.put
            self._wire, self._train = message, stream_frame(message.size_bytes)
            self._first_ns = self._sent_ns = now_ns = graph.kernel.now_ns
            size_bytes, segments = self._train
            put(pack(now_ns, graph.FRAME, self._from_id, self._to_id, message.seq, size_bytes))
            send(self._from, self._to, size_bytes, segments, False, self, message)
            return
        if self._latest is not None:  # what waits shall set out when that has arrived
            self._latest.book()
        outbox = self._outbox
        outbox.append(message)
        if 0 < self._limit < len(outbox):
            self._graph.drop(outbox.popleft(), self._host.index, "outbox_full")

    def topics(self, message: Message) -> tuple[str, ...]:
        return (message.topic,)

    def first_sent(self, message: Message, now_ns: int) -> int:
        return self._first_ns

    def expected(self, message: Message, receiver: int, arrival_ns: int) -> None:
        """The message will arrive at a host that keeps the latest of its topic."""
        latest = message.about.latest.get(receiver)
        if latest is None or self._outbox or self._closed is not None:
            self.await_(message, arrival_ns)
            return
        self._latest = latest
        latest.expect(self, message, arrival_ns)

    def land(self, message: Message, due_ns: int) -> None:
        """The message, whose arrival was no event, arrived at ``due_ns`` and was taken."""
        host, flights = self._host, self._flights
        assert flights is not None
        note, enter = flights.landed, self._graph.arrivals.note
        self._latest = self._wire = None
        note((host.index, *self._train))
        self._tries, trip_ns = 0, due_ns - self._sent_ns  # ``note_trip`` without its call
        if self._trip_ns < 0 or trip_ns < self._trip_ns:
            self._trip_ns = trip_ns
        enter(message, host, due_ns, self._first_ns, self._sent_ns)

    def await_(self, message: Message, due_ns: int) -> None:
        """Somebody waits for the message on the wire now, which arrives at ``due_ns``."""
        self._latest = None
        self.book(message, due_ns)

    def book(self, message: Message, due_ns: int) -> None:
        """The arrival of the message on the wire shall be an event."""
        assert self._flights is not None
        self._flights.book(self._from, self._host.index, *self._train, self, message, due_ns)

    def arrived(self, message: Message, receiver: int) -> None:
        """The medium delivered the frame."""
        self._wire = None
        if self._refused:
            self._give_room()
        self.note_trip(self._graph.kernel.now_ns - self._sent_ns)
        if self._closed == "link_closed":
            self._graph.drop(message, receiver, self._closed, self._first_ns, self._sent_ns)
            return
        self._graph.deliver(message, receiver, self._first_ns, self._sent_ns)
        if self._outbox and self._wire is None:
            self.offer(self._outbox.popleft())

    def arrived_in_part(self, message: Message, receiver: int, lost: dict[int, str]) -> None:
        """Send the lost segments again."""
        if self._closed is not None:
            self.lost(message, receiver, next(iter(lost.values())))
            return
        now_ns = self._graph.kernel.now_ns
        self.note_trip(now_ns - self._sent_ns)
        if self._refused:
            self._give_room()
        for reason in dict.fromkeys(lost.values()):
            self._record_loss(self._from, receiver, message.seq, reason)
        sizes = packet_sizes(*self._train)
        acked_ns = now_ns + self._trip_ns  # the acknowledgement
        if self.medium.refuses.issuperset(lost.values()):
            acked_ns = now_ns
        elif len(sizes) - 1 in lost:  # no later segment shows that it is missing
            acked_ns = fires_ns(acked_ns, self._patience_ns(), TICK_NS)
        self._train = sum(sizes[number] for number in lost), len(lost)
        self._wait(message, acked_ns)

    def lost(self, message: Message, receiver: int, reason: str) -> None:
        """The medium lost the frame: wait for the timeout that runs since it was sent."""
        if self._closed is not None:
            self._wire = None
            self._graph.drop(message, receiver, reason, self._first_ns, self._sent_ns)
            return
        self._record_loss(self._from, receiver, message.seq, reason)
        now_ns = self._graph.kernel.now_ns
        if reason in self.medium.refuses:
            self._refused.append(self)
            self._wait(message, fires_ns(now_ns, RTO_MIN_NS, TICK_NS))
            return
        self._wait(message, max(now_ns, fires_ns(self._sent_ns, self._patience_ns(), TICK_NS)))
        self._tries += 1

    def repeated(self, message: Message, receiver: int) -> None:
        """TCP recognises data that it has already by its sequence number, and discards it."""
        self._graph.repeat(message, receiver)

    def close(self, reason: str) -> None:
        """Drop all messages that wait. A frame on its way meets its own fate."""
        if self._latest is not None:
            self._latest.book()
        self._closed = reason
        graph, receiver = self._graph, self._host.index
        if self._timer is not None and self._wire is not None:
            self._timer.cancel()
            self._timer = None
            graph.drop(self._wire, receiver, reason, self._first_ns, self._sent_ns)
            self._wire = None
        for message in self._outbox:
            graph.drop(message, receiver, reason)
        self._outbox.clear()

    @property
    def waiting(self) -> int:
        return len(self._outbox) + (self._wire is not None)

    def note_trip(self, trip_ns: int) -> None:
        """Some of the segments that were sent last arrived ``trip_ns`` later."""
        self._tries = 0
        if self._trip_ns < 0 or trip_ns < self._trip_ns:
            self._trip_ns = trip_ns

    def _patience_ns(self) -> int:
        """The time until it goes again: first a probe, after two round trips where more than one
        segment is on its way, then the timeout (as in ``desim.middleware.tcp.retransmission``)."""
        rtt_ns = 2 * max(self._trip_ns, 0)
        if not self._tries and self._train[1] > 1:
            return min(2 * rtt_ns + 2 * TICK_NS, RTO_MIN_NS + rtt_ns)
        return min(RTO_MIN_NS + rtt_ns << max(self._tries - 1, 0), RTO_MAX_NS)

    def _wait(self, message: Message, until_ns: int) -> None:
        self._timer = self._graph.kernel.at(until_ns, Phase.NETWORK, self._entity, self._again,
                                            message)

    def _give_room(self) -> None:
        """A train of this host has left its interface: those that this has refused try again, until
        it refuses one."""
        refused = self._refused
        for _ in range(len(refused)):
            link = refused.popleft()
            if link._timer is not None and link._wire is not None:
                link._timer.cancel()
                link._again(link._wire)
                if refused and refused[-1] is link:
                    refused.rotate(1)
                    return

    def _again(self, message: Message) -> None:
        if self in self._refused:
            self._refused.remove(self)
        self._timer = None
        self._sent_ns = self._graph.kernel.now_ns
        self._graph.record_frame(self._from_id, self._to_id, message.seq, self._train[0])
        self._send(self._from, self._to, *self._train, False, self, message)
