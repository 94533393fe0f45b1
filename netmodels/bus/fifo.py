"""One common queue: frames have the bus in the order in which they were sent."""

from __future__ import annotations

from desim import ports
from netmodels.bus.stations import Cable
from netmodels.drop_tail import DropTailQueue, refuse


class Fifo:
    """A perfect arbiter: what the other disciplines are measured against."""

    def __init__(self, cable: Cable, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._cable = cable
        self._context = context
        self.free_ns = self.taken_ns = 0
        self._line = DropTailQueue(cable.queue_packets)
        self.transmissions = self.collisions = 0

    def take(self, frame: ports.Frame) -> None:
        cable, now_ns = self._cable, self._context.now_ns
        sizes = ports.packet_sizes(frame.size_bytes, frame.segments)
        begin_ns = max(now_ns, self.free_ns)
        fit = self._line.join(now_ns, begin_ns, cable.wire_ns(sizes[0]) + cable.gap_ns, len(sizes))
        refuse(self._context, frame, fit)
        if not fit:
            return
        self.transmissions += fit
        self.free_ns = begin_ns + sum(map(cable.wire_ns, sizes[:fit])) + fit * cable.gap_ns
        self.taken_ns += self.free_ns - begin_ns
        arrives_ns = self.free_ns - cable.gap_ns + cable.propagation_ns
        self._context.settle_many(frame, frame.receivers, ports.Deliver(arrives_ns - now_ns))
