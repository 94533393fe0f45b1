"""The receiving half of one direction of a connection: order, and acknowledgements."""

from __future__ import annotations

from typing import TYPE_CHECKING

from desim.engine.kernel import Phase
from desim.middleware.context import ACKS
from desim.middleware.headers import MSS_BYTES, SEGMENT_HEADER_BYTES, on_wire
from desim.middleware.jiffies import fires_ns
from desim.middleware.tcp.parameters import runs
from desim.middleware.tcp.transit import Train
from desim.network.carrier import Carrier
from desim.units import NEVER_NS

if TYPE_CHECKING:
    from desim.middleware.tcp.connection import Connection
    from desim.middleware.tcp.end import End
    from desim.middleware.tcp.transit import Transit
    from desim.ports.networks import Handle

_CONTROL = Phase.CONTROL  # of an instant, after what comes in it
_QUICK_BYTES = 16 * MSS_BYTES  # Linux TCP_MAX_QUICKACKS
_FIRST_MSS_BYTES = 536  # what Linux takes for a full segment before it has seen a larger one


class Receiver(Carrier[Train]):
    """Receives the trains of ``transit``, as their carrier. ``back`` is the sender at this end,
    with whose data an acknowledgement may travel.

    All before byte ``rcv_nxt`` has arrived (RCV.NXT of RFC 9293); ``out_of_order`` are the bytes
    behind a gap, sorted and disjoint. All before ``last_ack_sent`` (RFC 7323) was acknowledged; the
    rest will be with the next data of this end, or at ``ack_due_ns`` (0: there is no rest), with
    the time stamp ``ts_recent_ns``. At most a full segment waits: in ``pingpong`` mode (this end
    answers each message) any, else one amid a message. The end of a message is acknowledged at
    once, because the reader is always waiting (Linux tcp_cleanup_rbuf, ICSK_ACK_PUSHED).
    """

    protocol = "tcp"
    __slots__ = ("end", "back", "transit", "open", "rcv_nxt", "out_of_order", "ack_due_ns",
                 "ts_recent_ns", "received_ns", "last_ack_sent", "pingpong", "_rcv_mss", "_every",
                 "_behind", "_dsack", "_quickack_end", "_delay_ns", "_tick_ns", "_timer", "_kernel",
                 "_transmit", "_counts", "_frames", "_host", "_to", "_entity")

    transit: Transit

    def __init__(self, connection: Connection, end: End, entity: int) -> None:
        context = connection.tcp.context
        self.end, self.back = end, end.sender
        self.open = self.pingpong = False
        self.rcv_nxt = self.last_ack_sent = 0
        self.out_of_order: list[tuple[int, int]] = []
        self.ack_due_ns = self.ts_recent_ns = 0
        self.received_ns = -NEVER_NS
        self._dsack: tuple[int, int] | None = None  # bytes that have come twice (D-SACK, RFC 2883)
        self._quickack_end = _QUICK_BYTES  # up to there data is acknowledged at once
        self._rcv_mss = _FIRST_MSS_BYTES  # bytes of the largest segment seen
        constants = connection.tcp.constants
        self._every = every = constants.ack_every
        self._behind = every if every > 2 else 1  # of them, where they come behind a gap
        self._delay_ns, self._tick_ns = constants.delayed_ack_ns, constants.tick_ns
        self._timer: Handle | None = None
        self._kernel = context.kernel
        self._transmit = end.way.transmit
        self._counts, self._frames = context.discovery_bytes, context.discovery_frames
        self._host, self._to = end.host, (end.peer,)
        self._entity = entity

    @property
    def conversation(self) -> Connection:
        return self.end.connection

    def topics(self, train: Train) -> tuple[str, ...]:
        return self.transit.topics(train[0], train[1])

    def first_sent(self, train: Train, now_ns: int) -> int:
        return self.transit.first_sent(train[0], train[1], now_ns)

    def arrived(self, train: Train, receiver: int) -> None:
        start, end, ack, sent_ns, echo_ns, _, _ = train
        if not self.open:
            self.end.stray(self, train)
            return
        now_ns, heard_ns = self._kernel.now_ns, self.received_ns
        self.received_ns = now_ns
        if ack > self.back.snd_una:
            self.back.acked(ack, echo_ns)
        if start != self.rcv_nxt or self.out_of_order:
            self._take_out_of_order([(start, end)], sent_ns)
            return
        self.rcv_nxt = end
        if not self.ack_due_ns:
            self.ts_recent_ns = sent_ns
            self.ack_due_ns = now_ns + self._delay_ns
        transit = self.transit
        messages, delivered = transit.messages, transit.delivered
        if len(messages) > delivered and messages[delivered][0] == end:  # as nearly always: whole
            transit.delivered = delivered + 1
            _, arrived, token, _ = messages[delivered]
            arrived(token)
            pushed = True
        else:
            if now_ns - heard_ns > self.back.rto_ns:
                self._enter_quickack()
            pushed = self._deliver() or end <= self._quickack_end
        if not self.ack_due_ns:  # it was acknowledged, maybe by an answer, or all is over
            return
        if end - start > self._rcv_mss:
            self._rcv_mss = min(end - start, MSS_BYTES)
        pending = self.rcv_nxt - self.last_ack_sent
        if pending > self._rcv_mss or pushed and not self.pingpong:
            self.acknowledge(pending // MSS_BYTES // self._every or 1)
        elif self._timer is None:
            self._set_delack_timer()

    def arrived_in_part(self, train: Train, receiver: int, lost: dict[int, str]) -> None:
        """Some segments have arrived, which the acknowledgement tells."""
        start, end, ack, sent_ns, echo_ns, fin, count = train
        bounds = ([start + (end - start) * number // count for number in range(count + 1)]
                  if count else [*range(start, end, MSS_BYTES), end])
        self.transit.lose([(bounds[number], bounds[number + 1], reason)
                           for number, reason in lost.items()], end)
        pieces = [(bounds[first], bounds[last]) for first, last in runs(len(bounds) - 1, lost)]
        if not self.open or len(pieces) == 1:
            fin = fin and pieces[0][1] == end
            self.arrived((*pieces[0], ack, sent_ns, echo_ns, fin, 0), receiver)
            return
        self.received_ns = self._kernel.now_ns
        if ack > self.back.snd_una:
            self.back.acked(ack, echo_ns)
        if self.open:
            self._take_out_of_order(pieces, sent_ns)

    def lost(self, train: Train, receiver: int, reason: str) -> None:
        self.transit.lose([(train[0], train[1], reason)], train[1])

    def unresolved(self, train: Train) -> None:
        """The train could not leave: only a retransmission counts (``RetransmissionTimer``)."""
        self.transit.sender.retransmission.unresolved(train[0])

    def repeated(self, train: Train, receiver: int) -> None:
        """A copy that the network made is a segment like any other."""
        self.arrived(train, receiver)

    def acknowledge(self, segments: int) -> None:
        """Send so many acknowledgements as one train of them."""
        self.ack_due_ns = 0
        self.last_ack_sent = nxt = self.rcv_nxt
        ack = nxt, self.ts_recent_ns, tuple(self.out_of_order), self._dsack
        self._dsack = None
        size_bytes = segments * SEGMENT_HEADER_BYTES
        self._counts[ACKS] += size_bytes
        self._frames[ACKS] += 1
        self._transmit(self._host, self._to, size_bytes, segments, False, self.transit.sender,
                       ack)

    def piggyback(self, now_ns: int) -> int:
        """Data goes the other way, and an acknowledgement with it. Returns the time that it echoes,
        -1 if it acknowledges nothing new. An end that answers soon is taken to do so again
        (pingpong mode)."""
        if now_ns - self.received_ns < self._delay_ns:
            self.pingpong = True
        self.last_ack_sent = self.rcv_nxt
        if not self.ack_due_ns:
            return -1
        self.ack_due_ns = 0
        return self.ts_recent_ns

    def shut(self) -> None:
        """Take nothing more."""
        self.open = False
        self.ack_due_ns = 0
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _set_delack_timer(self) -> None:
        fires = fires_ns(self.ack_due_ns - self._delay_ns, self._delay_ns, self._tick_ns)
        self._timer = self._kernel.at(fires, _CONTROL, self._entity, self._delack_expired)

    def _delack_expired(self, _: object) -> None:
        self._timer = None
        if self.ack_due_ns > self._kernel.now_ns:
            self._set_delack_timer()
        elif self.ack_due_ns:
            self.pingpong = False  # there was no answer (Linux tcp_delack_timer_handler)
            self.acknowledge(1)

    def _deliver(self) -> bool:
        """Hand over each message that is complete now. Returns whether that is all: the reader has
        emptied the socket after the end of what was written, which is marked (PSH)."""
        transit, nxt = self.transit, self.rcv_nxt
        messages = transit.messages
        end = 0
        while len(messages) > (delivered := transit.delivered) and messages[delivered][0] <= nxt:
            end, arrived, token, _ = messages[delivered]
            transit.delivered = delivered + 1
            arrived(token)
            if not self.open:  # closed by this message: the rest is refused
                self.rcv_nxt = end
                break
        return end == self.rcv_nxt

    def _enter_quickack(self) -> None:
        """Acknowledge some segments at once (Linux tcp_enter_quickack_mode)."""
        self._quickack_end = self.rcv_nxt + _QUICK_BYTES

    def _take_out_of_order(self, pieces: list[tuple[int, int]], sent_ns: int) -> None:
        """Take data that is not simply the next: behind a gap, before data that has arrived, or a
        copy. It is acknowledged at once, each segment behind a gap by itself."""
        self.pingpong = False
        before = self.rcv_nxt
        answers = 0
        for start, end in pieces:
            if start <= self.last_ack_sent:
                self.ts_recent_ns = sent_ns
            if end <= self.rcv_nxt:
                answers += 1
                self._dsack = start, end
                self._enter_quickack()
                continue
            self._queue_out_of_order(max(start, self.rcv_nxt), end)
            if self.out_of_order[0][0] == self.rcv_nxt:
                self.rcv_nxt = self.out_of_order.pop(0)[1]
            else:
                answers += -(-on_wire(end - start)[1] // self._behind)
        answers += (self.rcv_nxt - before) // MSS_BYTES // self._every
        if self.rcv_nxt > before:
            self._deliver()
        if self.open:
            self.acknowledge(answers or 1)

    def _queue_out_of_order(self, start: int, end: int) -> None:
        kept = []
        for other_start, other_end in self.out_of_order:
            if other_end < start or end < other_start:
                kept.append((other_start, other_end))
            else:
                start, end = min(start, other_start), max(end, other_end)
        kept.append((start, end))
        kept.sort()
        self.out_of_order = kept
