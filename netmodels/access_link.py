"""An access link per host, with unlimited capacity behind it."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import Field

from desim import ports
from desim.ports import packet_sizes
from desim.units import NS_PER_S, BitRate, ByteSize, Duration, airtime_ns
from netmodels.itemized import Itemized
from netmodels.queues import DropTailQueue, fitting, refuse


class AccessLink(Itemized):
    """Each host has its own full-duplex link of ``rate`` and ``latency`` with a drop-tail queue.

    delay = wait behind the sender's own earlier frames + size * 8 / rate + latency. Receiving is
    free: where several senders meet at one receiver's port, ``switch`` is the model. A broadcast
    takes the link once and is copied behind it. Of a train those packets are dropped for which
    the queue has no place.

    Capabilities: Refuses, CountsBusyTime, Itemizes, KnowsDepartures.
    """

    class Params(ports.Params):
        rate_bps: BitRate = Field("100 Mb/s", description="(Fast Ethernet)")
        latency_ns: Duration = Field("0 ns", description="one way, after the last bit was sent "
                                                         "(none)")
        queue_bytes: ByteSize = Field(
            "64 MB", description="what may wait before the link, what is being sent included; the "
                                 "send buffers of a host's sockets (Linux: up to 4 MB each) stand "
                                 "here too (room for 16)")
        queue_packets: int | None = Field(None, ge=0, description=(
            "that wait beside the one that is being sent (none: bytes alone count)"))

    reasons = ("queue_full",)
    refuses = ("queue_full",)

    def __init__(self, params: Params) -> None:
        self._rate_bps = params.rate_bps
        self._latency_ns = params.latency_ns
        self._queue_bytes = params.queue_bytes
        self._params = params

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._free_ns = [0] * len(hosts)
        self._booked_ns = [0] * len(hosts)  # of sending, up to then
        limit = self._params.queue_packets
        self._lines = None if limit is None else [DropTailQueue(limit) for _ in hosts]

    def send(self, frame: ports.Frame) -> int | None:
        context, size_bytes = self._context, frame.size_bytes
        now_ns = context.now_ns
        begin_ns = max(now_ns, self._free_ns[frame.source])
        waiting_bytes = (begin_ns - now_ns) * self._rate_bps // (8 * NS_PER_S)
        if waiting_bytes + size_bytes > self._queue_bytes or self._lines is not None:
            fit, size_bytes = self._let_in(frame, begin_ns, self._queue_bytes - waiting_bytes)
            refuse(context, frame, fit)
            if not fit:
                return None
        end_ns = begin_ns + airtime_ns(size_bytes, self._rate_bps)
        self._free_ns[frame.source] = end_ns
        self._booked_ns[frame.source] += end_ns - begin_ns
        spent = self._ledger.spent
        spent(frame, ports.TimePart.QUEUE, begin_ns - now_ns)
        spent(frame, ports.TimePart.AIRTIME, end_ns - begin_ns)
        spent(frame, ports.TimePart.PROPAGATION, self._latency_ns)
        return end_ns - now_ns + self._latency_ns

    def _let_in(self, frame: ports.Frame, begin_ns: int, free_bytes: int) -> tuple[int, int]:
        """Let in the packets of ``frame`` that fit. Returns how many, and their bytes."""
        sizes, now_ns = packet_sizes(frame.size_bytes, frame.segments), self._context.now_ns
        fit = fitting(sizes, free_bytes, begin_ns <= now_ns)
        if self._lines is not None:
            fit = self._lines[frame.source].join(
                now_ns, begin_ns, airtime_ns(sizes[0], self._rate_bps), fit)
        return fit, sum(sizes[:fit])

    def departure_ns(self, host: int) -> int:
        """``ports.KnowsDepartures``."""
        return self._free_ns[host]

    def busy_ns(self, hosts: Sequence[int]) -> list[int]:
        """For how long the link of each of ``hosts`` was sending."""
        now_ns = self._context.now_ns
        return [self._booked_ns[host] - max(self._free_ns[host] - now_ns, 0) for host in hosts]
