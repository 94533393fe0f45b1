"""A line behind FQ-CoDel, as the group ``fq_codel`` has it in Linux."""

from __future__ import annotations

from collections.abc import Hashable
from typing import NamedTuple

from desim import ports
from desim.units import BitRate, Duration, airtime_ns
from netmodels.infrastructure.fq_codel import FqCodel, FqCodelConstants
from netmodels.infrastructure.outlets import AirHop
from netmodels.infrastructure.packet_queue import Dropped, Waiting
from netmodels.infrastructure.trips import Trip
from netmodels.partial_trains import settle_without

CHECK_SEQUENCE_BYTES = 4  # which Linux does not count


class Sojourn(NamedTuple):
    """A packet that has left the queue or was dropped from it."""

    flow: Hashable
    at_ns: int
    waited_ns: int
    dropped: bool


class FqCodelLink:
    """A line from the first host to the others, which a packet enters when the one before has had
    its airtime; it is there at once. What comes back takes ``back`` and waits for nothing.
    ``sojourns``: of all packets in the queue."""

    class Params(ports.Params):
        """Of the line and its queue."""

        rate_bps: BitRate
        back_ns: Duration
        queue: FqCodelConstants

    reasons = ("codel", "queue_full")

    def __init__(self, params: Params) -> None:
        self._params, self._queue = params, FqCodel(params.queue)
        self._free_ns = 0
        self._waits = False  # for the line
        self.sojourns: list[Sojourn] = []

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context

    def send(self, frame: ports.Frame) -> int | None:
        if frame.source:
            return self._params.back_ns
        now_ns = self._context.now_ns
        hop = AirHop(Trip(frame, self._context.flow(frame), now_ns), frame.receivers, False,
                     self._over)
        self._lose(self._queue.push(now_ns, [
            Waiting(hop, number, size_bytes - CHECK_SEQUENCE_BYTES, now_ns)
            for number, size_bytes in enumerate(hop.sizes)]))
        if not self._waits:
            self._waits = True
            self._context.at(max(now_ns, self._free_ns), self._serve, None)
        return None

    def _serve(self, _: None) -> None:
        now_ns, dropped = self._context.now_ns, list[Dropped]()
        packet = self._queue.pop(now_ns, dropped)
        self._lose(dropped)
        self._waits = packet is not None
        if packet is not None:
            self._free_ns = now_ns + airtime_ns(packet.size_bytes, self._params.rate_bps)
            self._context.at(self._free_ns, self._serve, None)
            self._gone(packet, {})

    def _lose(self, dropped: list[Dropped]) -> None:
        for packet, reason in dropped:
            self._gone(packet, {packet.number: reason})

    def _gone(self, packet: Waiting, lost: dict[int, str]) -> None:
        hop, now_ns = packet.hop, self._context.now_ns
        self.sojourns.append(Sojourn(hop.trip.flow, now_ns, now_ns - packet.since_ns, bool(lost)))
        hop.settle(hop.receivers, (packet.number,), lost, None)

    def _over(self, hop: AirHop, _: ports.Frame | None) -> None:
        """All packets of a frame have left the queue."""
        (receiver,) = hop.receivers
        lost = hop.lost[receiver]
        settle_without(self._context, hop.trip.frame, receiver, {
            reason: [number for number, why in lost.items() if why == reason]
            for reason in sorted({*lost.values()})})
