"""The receiving half of one direction of a connection: order, and when to acknowledge."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from desim.kernel import Phase
from desim.middleware.context import ACKS
from desim.middleware.tcp.parameters import on_wire, runs
from desim.middleware.transports import MSS_BYTES, SEGMENT_HEADER_BYTES

if TYPE_CHECKING:
    from desim.middleware.tcp.connection import Connection
    from desim.middleware.tcp.end import End
    from desim.middleware.tcp.sender import Sender

_CONTROL = Phase.CONTROL  # of an instant, after what comes in it
_FIRST_MSS_BYTES = 536  # what Linux takes for a full segment before it has seen a larger one

# What a data train carries beside its bytes: first byte, end, what its sender has received, when it
# was sent, the time that it echoes (-1: none, for what it acknowledges was so before).
Train = tuple[int, int, int, int, int]


class Receiver:
    """Hears the trains that ``origin``, the sender at the other end, has sent; ``back`` is the
    sender at this end, with whose data an acknowledgement may travel.

    Up to byte ``nxt`` all is here; ``ranges`` holds what came out of order, sorted and disjoint.
    The origin was told up to ``said``; it will be told more at ``due_ns`` (0: there is no more), or
    with the next data of this end.
    """

    __slots__ = ("end", "origin", "back", "open", "nxt", "ranges", "due_ns", "echo_ns", "heard_ns",
                 "said", "_full", "_implied", "_every", "_delay_ns", "_timer", "_kernel",
                 "_transmit", "_counts", "_frames", "_up", "_host", "_to", "_entity")

    def __init__(self, connection: Connection, end: End, entity: int) -> None:
        graph = connection.tcp.context.graph
        self.end = end
        self.origin: Sender
        self.back: Sender
        self.open = False
        self.nxt = 0
        self.ranges: list[tuple[int, int]] = []
        self.due_ns = 0
        self.echo_ns = 0
        self.heard_ns = 0
        self.said = 0
        self._full = _FIRST_MSS_BYTES  # bytes of the largest segment seen
        self._up = graph.up
        self._implied = connection.tcp.params.acks == "implied"
        self._every = connection.tcp.params.ack_every
        self._delay_ns = connection.tcp.params.delayed_ack_ns
        self._timer: Any = None
        self._kernel = graph.kernel
        self._transmit = connection.medium.transmit
        self._counts = connection.tcp.context.discovery_bytes
        self._frames = connection.tcp.context.discovery_frames
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
            self._out_of_order(start, end, sent_ns)
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
        if unsaid > self._full:
            self.acknowledge(unsaid // MSS_BYTES // self._every or 1)
        elif self._timer is None:
            self._timer = self._kernel.after(self._delay_ns, _CONTROL, self._entity, self._due)

    def arrived_in_part(self, train: Train, receiver: int, lost: dict[int, str]) -> None:
        """Each run of segments that arrived is heard like a train of its own."""
        start, end, ack, sent_ns, echo_ns = train
        for number, reason in lost.items():
            first = start + number * MSS_BYTES
            self.origin.end.lost_train(first, min(first + MSS_BYTES, end), reason)
        for first, last in runs(on_wire(end - start)[1], lost):
            self.arrived((start + first * MSS_BYTES, min(start + last * MSS_BYTES, end), ack,
                          sent_ns, echo_ns), receiver)

    def lost(self, train: Train, receiver: int, reason: str) -> None:
        """The medium lost it. The sender does not know; the trace does."""
        self.origin.end.lost_train(train[0], train[1], reason)

    def repeated(self, train: Train, receiver: int) -> None:
        """A copy that the network made is a segment like any other."""
        self.arrived(train, receiver)

    def acknowledge(self, segments: int, duplicates: int = 0) -> None:
        """Send so many acknowledgements as one train of them; ``duplicates`` of them are for
        segments out of order."""
        self.due_ns = 0
        self.said = nxt = self.nxt
        ranges = self.ranges
        if ranges:
            hole_end = ranges[0][0]
            beyond = sum(end - start for start, end in ranges)
        else:
            hole_end = beyond = 0
        ack = nxt, self.echo_ns, hole_end, beyond, duplicates
        if self._implied:
            peer = self.end.peer
            if self._up[peer]:
                self.origin.arrived(ack, peer)
            return
        size_bytes = segments * SEGMENT_HEADER_BYTES
        self._counts[ACKS] += size_bytes
        self._frames[ACKS] += 1
        self._transmit(self._host, self._to, size_bytes, segments, False, self.origin, ack)

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

    def _due(self, _: Any) -> None:
        self._timer = None
        due_ns = self.due_ns
        if not due_ns:
            return
        now_ns = self._kernel.now_ns
        if due_ns > now_ns:
            self._timer = self._kernel.after(due_ns - now_ns, _CONTROL, self._entity,
                                             self._due)
        else:
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

    def _out_of_order(self, start: int, end: int, sent_ns: int) -> None:
        """A gap before it, a gap behind it that others filled, or nothing new: answer at once."""
        self.echo_ns = sent_ns
        if end <= self.nxt:
            self.acknowledge(1)
            return
        duplicates = 0
        self._add(max(start, self.nxt), end)
        if self.ranges[0][0] == self.nxt:
            self.nxt = self.ranges.pop(0)[1]
            self._deliver()
        else:
            duplicates = on_wire(end - start)[1]
        if self.open:
            self.acknowledge(max(duplicates, 1), duplicates)

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
