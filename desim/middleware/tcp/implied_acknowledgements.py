"""Implied acknowledgements (``acks: implied``): a sender knows at once what has arrived.

They allow a shortcut for a message over a connection at rest: no sequence numbers, and no timer if
it will arrive in time. Most messages go this way (between hosts that are not near, those of one
segment): nothing else is under way, the network tells at once when the message will arrive, and its
sender knows it then. Any other event before that (another message, a loss, a stop) moves the
message into the ordinary stream (``join``), as if it had been sent there.

A connection at rest may be lent: others send its messages in batches (``desim.middleware.batches``)
and report later what became of them. Whatever looks at it or changes it reclaims it first.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from desim.middleware.arp import AddressedCarrier
from desim.middleware.tcp.receiver import Receiver
from desim.middleware.tcp.transit import FIN, Token, Train
from desim.middleware.timers import NEVER
from desim.middleware.transports import MSS_BYTES, on_wire

if TYPE_CHECKING:
    from desim.middleware.tcp.connection import Connection
    from desim.middleware.tcp.end import End
    from desim.middleware.tcp.sender import Sender

# Its bytes, arrived, token, kind, and when it was sent.
Flight = tuple[int, Callable[..., object], Token, "str | None", int]


class Express(AddressedCarrier[Flight]):
    """The one-step path of one sender. ``ready``: nothing is under way except ``flight``, and
    ``more`` behind it."""

    protocol = "tcp"
    __slots__ = ("ready", "lent", "flight", "more", "_sender", "_kernel", "_context", "_way",
                 "_transmit", "_host", "_to", "_host_id", "_to_id", "_most_bytes", "_patience_ns",
                 "_timed", "_since_ns", "_nodelay", "_joined", "_record_frame")

    def __init__(self, sender: Sender) -> None:
        constants = sender.constants
        end = sender.end
        self.ready = self.lent = False
        self.flight: Flight | None = None
        self.more: list[Flight] = []
        self._joined: list[tuple[Flight, int]] = []  # since all was at rest, and where they begin
        self._sender = sender
        self._nodelay = sender.nodelay
        self._context = context = end.connection.tcp.context
        self._kernel = context.kernel
        self._record_frame = context.record_frame
        self._way = end.way
        self._transmit = end.way.transmit
        self._host, self._to = end.host, (end.peer,)
        self._host_id, self._to_id = context.host_ids[end.host], context.host_ids[end.peer]
        self._most_bytes = min(constants.train * MSS_BYTES, constants.window_bytes)
        self._patience_ns = constants.rto_min_ns
        self._timed = False  # the timer runs
        self._since_ns = 0  # from when it does, or would

    @property
    def conversation(self) -> Connection:
        return self._sender.end.connection

    def send(self, size_bytes: int, arrived: Callable[..., object], token: Token,
             kind: str | None, writes: int) -> bool:
        """Send a message, or return False: the ordinary stream has to (what is under way joins)."""
        if self.lent:
            self.reclaim()
        sender = self._sender
        if not self.ready or kind is FIN or writes > 1 \
                or size_bytes > (self._most_bytes if sender.near else min(MSS_BYTES, sender.cwnd)) \
                or (self.flight is not None and not self._follows(size_bytes)):
            self.join()
            return False
        now_ns = self._kernel.now_ns
        on_wire_bytes, segments = on_wire(size_bytes)
        if kind is None:
            token.last_ns = now_ns
            if token.first_ns < 0:
                token.first_ns = now_ns
            self._record_frame(self._host_id, self._to_id, token.seq, on_wire_bytes)
        else:
            self._context.record_control(kind, self._host, self._to_id, on_wire_bytes)
        flight = size_bytes, arrived, token, kind, now_ns
        if self.flight is None:
            self.flight = flight
            self._since_ns = now_ns
            self._joined.clear()
            if sender.cwnd != sender.initial or size_bytes > MSS_BYTES:
                sender.wake()
        else:
            self.more.append(flight)
        sender.sent_ns = now_ns
        due_ns = self._transmit(self._host, self._to, on_wire_bytes, segments, False, self, flight)
        since_ns = self._since_ns
        if (due_ns is None or due_ns - since_ns >= self._patience_ns) and not self._timed \
                and self.flight is not None:
            self._timed = True
            sender.timer.expect(since_ns + sender.rto_ns)
        return True

    # Others send in its stead.

    def lend(self, size_bytes: int) -> bool:
        """Whether a message of ``size_bytes`` would go at once in one step, and change nothing but
        times and the estimate of the round trip. If so, others may send such messages from now on,
        and report them by ``landed``, until somebody looks at the sender (``reclaim``)."""
        sender = self._sender
        if not (self.ready or self.lent) or self.flight is not None or not self._way.known \
                or size_bytes > (min(self._most_bytes, sender.cwnd // 2) if sender.near
                                 else MSS_BYTES) or not sender.is_fresh:
            return False
        self.lent, self.ready = True, False
        return True

    def landed(self, sent_ns: Sequence[int], trips_ns: Sequence[int]) -> None:
        """Messages that were sent in its stead at these times have arrived so much later."""
        sender, arrived_ns = self._sender, 0
        for begin_ns, trip_ns in zip(sent_ns, trips_ns, strict=True):
            arrived_ns = begin_ns + trip_ns
            sender.sample(trip_ns, arrived_ns)
        sender.sent_ns = sent_ns[-1]
        sender.transit.express_ns = arrived_ns
        self._way.used(sent_ns[-1], arrived_ns)

    def reclaim(self) -> None:
        """Take over what others have sent in its stead, and lend no more."""
        if self.lent:
            self.lent, self.ready = False, True
            self._context.release(self._host)

    def take(self, size_bytes: int, arrived: Callable[..., object], token: Token, sent_ns: int,
             due_ns: int) -> Flight:
        """Take over a message that was sent in its stead, and will arrive at ``due_ns``."""
        flight = size_bytes, arrived, token, None, sent_ns
        sender = self._sender
        self.flight = flight
        self._since_ns = sender.sent_ns = sent_ns
        self._joined.clear()
        self._way.used(sent_ns)
        if due_ns - sent_ns >= self._patience_ns:
            self._timed = True
            sender.timer.expect(sent_ns + sender.rto_ns)
        return flight

    def flying(self) -> int:
        """The bytes on their way."""
        if self.flight is None:
            return 0
        return self.flight[0] + sum(flight[0] for flight in self.more)

    def topics(self, flight: Flight) -> tuple[str, ...]:
        return (flight[2].topic,) if flight[3] is None else ()

    def first_sent(self, flight: Flight, now_ns: int) -> int:
        transit = self._sender.transit
        if transit.firsts is None:
            transit.firsts = deque()
        return flight[4]

    def arrived(self, flight: Flight, receiver: int) -> None:
        if flight is not self.flight:
            self.join()
            self._sender.transit.receiver.arrived(self._train(flight), receiver)
            return
        sender = self._sender
        if self.more or flight[0] * 2 > sender.cwnd:
            flying = self.flying()
            if flying * 2 > sender.cwnd:
                sender.grow(flight[0], flying + MSS_BYTES > sender.cwnd, self._kernel.now_ns)
        self.flight = self.more.pop(0) if self.more else None
        sender.transit.express_ns = self._since_ns = now_ns = self._kernel.now_ns
        self._way.confirmed_ns = now_ns
        sender.sample(now_ns - flight[4], now_ns)
        if self._timed:
            if self.flight is None:
                self._timed = False
                sender.timer.deadline_ns = NEVER
            else:
                sender.timer.expect(now_ns + sender.rto_ns)
        flight[1](flight[2])

    def arrived_in_part(self, flight: Flight, receiver: int, lost: dict[int, str]) -> None:
        """Some packets of a message are lost: the ordinary stream repairs it."""
        self.join()
        self._sender.transit.receiver.arrived_in_part(self._train(flight), receiver, lost)

    def lost(self, flight: Flight, receiver: int, reason: str) -> None:
        """The medium lost it. The sender does not know; its timer will."""
        self.join()
        self._sender.transit.receiver.lost(self._train(flight), receiver, reason)

    def repeated(self, flight: Flight, receiver: int) -> None:
        """A copy, which is a train like any other."""
        self._sender.transit.receiver.repeated(self._train(flight), receiver)

    def join(self) -> None:
        """Move what is under way into the ordinary stream."""
        self.reclaim()
        self.ready = False
        if self.flight is None:
            return
        flights = self.flight, *self.more
        self.flight = None
        self.more.clear()
        for flight in flights:
            self._joined.append((flight, self._sender.sent(*flight)))
        self._timed = False
        self._sender.timer.expect(self._since_ns + self._sender.rto_ns)

    def _train(self, flight: Flight) -> Train:
        """The train of a flight that has joined, or of one of which all has arrived already. It
        acknowledges nothing of the other direction."""
        size_bytes, *_, sent_ns = flight
        for other, start in self._joined:
            if other is flight:
                return start, start + size_bytes, 0, sent_ns, -1, False, 0
        return -1, -1, 0, sent_ns, -1, False, 0

    def _follows(self, size_bytes: int) -> bool:
        """Whether a message may be sent before those on their way have arrived."""
        return (self._nodelay and size_bytes <= MSS_BYTES
                and self.flying() + size_bytes <= self._sender.cwnd)


class ImpliedReceiver(Receiver):
    """A receiver whose acknowledgements are no frames: it gives them to the sender at once."""

    __slots__ = ("_up", "_peer")

    def __init__(self, connection: Connection, end: End, entity: int) -> None:
        super().__init__(connection, end, entity)
        self._up = connection.tcp.context.up
        self._peer = end.peer
        self.prompt = True

    def acknowledge(self, segments: int) -> None:
        self.due_ns = 0
        self.acknowledged = self.nxt
        if self._up(self._peer):
            self.transit.sender.arrived((self.nxt, self.echo_ns, tuple(self.ranges), self._copy),
                                        self._peer)
        self._copy = None

    def express_for(self, sender: Sender) -> Express | None:
        return Express(sender)

    def shut(self) -> None:
        was_open = self.open
        super().shut()
        if was_open:  # in the midst of an arrival
            self.acknowledge(1)
