"""The receiving half of one direction of a connection: order, and when to acknowledge."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from desim.engine.kernel import Phase
from desim.middleware.context import ACKS
from desim.middleware.jiffies import fires_ns
from desim.middleware.tcp.parameters import on_wire, runs
from desim.middleware.transports import MSS_BYTES, SEGMENT_HEADER_BYTES

if TYPE_CHECKING:
    from desim.middleware.tcp.connection import Connection
    from desim.middleware.tcp.end import End
    from desim.middleware.tcp.sender import Sender

_CONTROL = Phase.CONTROL  # of an instant, after what comes in it
_NEVER_NS = -1 << 62
_FIRST_MSS_BYTES = 536  # what Linux takes for a full segment before it has seen a larger one

# What a data train carries beside its bytes: first byte, end, what its sender has received, when it
# was sent, the time that it echoes (-1: none, for what it acknowledges was so before).
Train = tuple[int, int, int, int, int]


class Receiver:
    """Hears the trains that ``origin``, the sender at the other end, has sent; ``back`` is the
    sender at this end, with whose data an acknowledgement may travel.

    Up to byte ``nxt`` all is here; ``ranges`` holds what came out of order, sorted and disjoint.
    The origin was told up to ``said``; it will be told more with the next data of this end, or at
    ``due_ns`` (0: there is no more). It waits so only in ``pingpong`` mode, where this end answers
    what it hears; else the reader, who is always waiting, has it acknowledged at once (Linux
    tcp_cleanup_rbuf).
    """

    __slots__ = ("end", "origin", "back", "open", "nxt", "ranges", "due_ns", "echo_ns", "heard_ns",
                 "said", "pingpong", "_full", "_implied", "_every", "_delay_ns", "_tick_ns",
                 "_timer", "_kernel", "_transmit", "_counts", "_frames", "_up", "_host", "_to",
                 "_entity")

    def __init__(self, connection: Connection, end: End, entity: int) -> None:
        context = connection.tcp.context
        self.end = end
        self.origin: Sender
        self.back: Sender
        self.open = False
        self.nxt = 0
        self.ranges: list[tuple[int, int]] = []
        self.due_ns = 0
        self.echo_ns = 0
        self.heard_ns = _NEVER_NS
        self.said = 0
        self.pingpong = False
        self._full = _FIRST_MSS_BYTES  # bytes of the largest segment seen
        self._up = context.up
        self._implied = connection.tcp.params.acks == "implied"
        self._every = connection.tcp.params.ack_every
        self._delay_ns = connection.tcp.params.delayed_ack_ns
        self._tick_ns = connection.tcp.params.tick_ns
        self._timer: Any = None
        self._kernel = context.kernel
        self._transmit = end.way.transmit
        self._counts, self._frames = context.discovery_bytes, context.discovery_frames
        self._host, self._to = end.host, (end.peer,)
        self._entity = entity

    def arrived(self, train: Train, receiver: int) -> None:
        start, end, ack, sent_ns, echo_ns = train
        if not self.open:
            self.end.stray(self, train)
            return
        self.heard_ns = now_ns = self._kernel.now_ns
        if ack > self.back.una:
            self.back.acked(ack, echo_ns)
        if start != self.nxt or self.ranges:
            self._take([(start, end)], sent_ns)
            return
        self.nxt = end
        if not self.due_ns:
            self.echo_ns = sent_ns
            self.due_ns = now_ns + self._delay_ns
        origin = self.origin
        messages, heard = origin.messages, origin.heard
        if len(messages) > heard and messages[heard][0] == end:  # as nearly always: it is complete
            origin.heard = heard + 1
            _, arrived, token, _ = messages[heard]
            if self._implied:
                self.acknowledge(1)
                arrived(token)
                return
            arrived(token)
        else:
            self._deliver()
            if self._implied and self.open:
                self.acknowledge(1)
        if not self.due_ns:  # it was acknowledged by an answer, or all is over
            return
        if end - start > self._full:
            self._full = min(end - start, MSS_BYTES)
        unsaid = self.nxt - self.said
        if unsaid > self._full or not self.pingpong:
            self.acknowledge(unsaid // MSS_BYTES // self._every or 1)
        elif self._timer is None:
            self._wait()

    def arrived_in_part(self, train: Train, receiver: int, lost: dict[int, str],
                        bounds: Sequence[int] = ()) -> None:
        """The acknowledgement says which runs of its segments are here. ``bounds``: where each of
        these begins, and where the last one ends (default: they are full)."""
        start, end, ack, sent_ns, echo_ns = train
        bounds = bounds or [*range(start, end, MSS_BYTES), end]
        origin = self.origin
        for number, reason in lost.items():
            origin.end.lost_train(bounds[number], bounds[number + 1], reason)
        pieces = [(bounds[first], bounds[last]) for first, last in runs(len(bounds) - 1, lost)]
        origin.watch.hide(end)
        if not self.open:
            self.end.stray(self, (*pieces[0], ack, sent_ns, echo_ns))
            return
        self.heard_ns = self._kernel.now_ns
        if ack > self.back.una:
            self.back.acked(ack, echo_ns)
        if self.open:
            self._take(pieces, sent_ns)

    def lost(self, train: Train, receiver: int, reason: str) -> None:
        """The medium lost it. The sender does not know; the trace does."""
        self.origin.end.lost_train(train[0], train[1], reason)
        self.origin.watch.hide(train[1])

    def unresolved(self, train: Train) -> None:
        """The train could not leave: only a retransmission counts (``Watch``)."""
        self.origin.watch.unresolved(train[0])

    def repeated(self, train: Train, receiver: int) -> None:
        """A copy that the network made is a segment like any other."""
        self.arrived(train, receiver)

    def acknowledge(self, segments: int) -> None:
        """Send so many acknowledgements as one train of them."""
        self.due_ns = 0
        self.said = nxt = self.nxt
        ack = nxt, self.echo_ns, tuple(self.ranges)
        if self._implied:
            peer = self.end.peer
            if self._up(peer):
                self.origin.arrived(ack, peer)
            return
        size_bytes = segments * SEGMENT_HEADER_BYTES
        self._counts[ACKS] += size_bytes
        self._frames[ACKS] += 1
        self._transmit(self._host, self._to, size_bytes, segments, False, self.origin, ack)

    def answer(self, now_ns: int) -> int:
        """Data goes the other way, and an acknowledgement with it. Returns the time that it echoes,
        -1 if it tells no news. Who answers soon is taken to do so again (pingpong mode)."""
        if now_ns - self.heard_ns < self._delay_ns:
            self.pingpong = True
        self.said = self.nxt
        if not self.due_ns:
            return -1
        self.due_ns = 0
        return self.echo_ns

    def shut(self) -> None:
        """Hear nothing more."""
        self.origin.join()
        heard, self.open = self.open, False
        if heard and self._implied:  # in the midst of what is arriving
            self.acknowledge(1)
        self.due_ns = 0
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _wait(self) -> None:
        fires = fires_ns(self.due_ns - self._delay_ns, self._delay_ns, self._tick_ns)
        self._timer = self._kernel.at(fires, _CONTROL, self._entity, self._due)

    def _due(self, _: Any) -> None:
        self._timer = None
        if self.due_ns > self._kernel.now_ns:
            self._wait()
        elif self.due_ns:
            self.pingpong = False  # there was no answer (Linux tcp_delack_timer_handler)
            self.acknowledge(1)

    def _deliver(self) -> None:
        """Hand over each message that is complete now."""
        origin = self.origin
        messages, nxt = origin.messages, self.nxt
        while len(messages) > (heard := origin.heard):
            entry = messages[heard]
            if entry[0] > nxt:
                return
            origin.heard = heard + 1
            entry[1](entry[2])
            if not self.open:  # closed by what it heard: the rest is refused
                self.nxt = entry[0]
                return

    def _take(self, pieces: list[tuple[int, int]], sent_ns: int) -> None:
        """Take in data that is not simply the next: with a gap before it, before data that is
        here already, or nothing new. It is answered at once, each segment behind a gap by
        itself."""
        self.pingpong = False
        before = self.nxt
        answers = 0
        for start, end in pieces:
            if start <= self.said:
                self.echo_ns = sent_ns
            if end <= self.nxt:
                answers += 1
                continue
            self._add(max(start, self.nxt), end)
            if self.ranges[0][0] == self.nxt:
                self.nxt = self.ranges.pop(0)[1]
            else:
                answers += on_wire(end - start)[1]
        answers += (self.nxt - before) // MSS_BYTES // self._every
        if self.nxt > before:
            self._deliver()
        if self.open:
            self.acknowledge(answers or 1)

    def _add(self, start: int, end: int) -> None:
        kept = []
        for other_start, other_end in self.ranges:
            if other_end < start or end < other_start:
                kept.append((other_start, other_end))
            else:
                start, end = min(start, other_start), max(end, other_end)
        kept.append((start, end))
        kept.sort()
        self.ranges = kept
