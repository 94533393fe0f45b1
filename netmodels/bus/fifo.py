"""One common queue: frames have the bus in the order in which they were sent."""

from __future__ import annotations

from collections import deque

from desim import ports
from netmodels.bus.stations import Cable


class Fifo:
    """A perfect arbiter: what the other disciplines are measured against."""

    def __init__(self, cable: Cable, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._cable = cable
        self._context = context
        self.free_ns = self.taken_ns = 0
        self._waiting: deque[tuple[int, int]] = deque()  # when a frame begins, its packets
        self._packets = 0  # in all that waits
        self.transmissions = self.collisions = 0

    def take(self, frame: ports.Frame) -> bool:
        """False if the queue is full."""
        cable, now_ns, waiting = self._cable, self._context.now_ns, self._waiting
        while waiting and waiting[0][0] <= now_ns:
            self._packets -= waiting.popleft()[1]
        if self._packets >= cable.queue_packets:
            return False
        self.transmissions += frame.segments
        begin_ns = max(now_ns, self.free_ns)
        if begin_ns > now_ns:
            waiting.append((begin_ns, frame.segments))
            self._packets += frame.segments
        end_ns = (begin_ns + cable.wire_ns(frame.size_bytes, frame.segments)
                  + (frame.segments - 1) * cable.gap_ns)
        self.free_ns = end_ns + cable.gap_ns
        self.taken_ns += self.free_ns - begin_ns
        self._context.settle_many(frame, frame.receivers,
                                  ports.Deliver(end_ns - now_ns + cable.propagation_ns))
        return True
