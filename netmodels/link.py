"""An access link per host, and nothing but free capacity behind it."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from pydantic import Field

from desim import ports
from desim.units import NS_PER_S, BitRate, ByteSize, Duration, airtime_ns


class Line:
    """Who waits at a host, where packets are counted: when each frame begins, and its packets."""

    __slots__ = ("_begins", "_limit", "_packets")

    def __init__(self, limit: int) -> None:
        self._begins: deque[tuple[int, int]] = deque()
        self._limit = limit
        self._packets = 0

    def join(self, now_ns: int, begin_ns: int, packets: int) -> bool:
        """False if so many wait that one more may not wait until ``begin_ns``."""
        begins = self._begins
        while begins and begins[0][0] <= now_ns:
            self._packets -= begins.popleft()[1]
        if begin_ns > now_ns:
            if self._packets >= self._limit:
                return False
            begins.append((begin_ns, packets))
            self._packets += packets
        return True


class Link:
    """Each host has its own full-duplex link of ``rate`` and ``latency`` with a drop-tail queue.

    delay = wait behind the sender's own earlier frames + size * 8 / rate + latency. Receiving is
    free: where several senders meet at one receiver's port, ``switch`` is the model. A broadcast
    takes the link once and is copied behind it.
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
            "that wait beside the one that is being sent; a train that finds fewer is let in whole "
            "(none: bytes alone count)"))

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
        self._lines = None if limit is None else [Line(limit) for _ in hosts]

    def send(self, frame: ports.Frame) -> int | None:
        context, size_bytes = self._context, frame.size_bytes
        now_ns = context.now_ns
        begin_ns = max(now_ns, self._free_ns[frame.source])
        waiting_bytes = (begin_ns - now_ns) * self._rate_bps // (8 * NS_PER_S)
        if (waiting_bytes and waiting_bytes + size_bytes > self._queue_bytes
                or self._lines is not None
                and not self._lines[frame.source].join(now_ns, begin_ns, frame.segments)):
            context.settle_many(frame, frame.receivers, ports.Drop("queue_full"))
            return None
        end_ns = begin_ns + airtime_ns(size_bytes, self._rate_bps)
        self._free_ns[frame.source] = end_ns
        self._booked_ns[frame.source] += end_ns - begin_ns
        return end_ns - now_ns + self._latency_ns

    def busy_ns(self, hosts: Sequence[int]) -> list[int]:
        """``ports.NetworkModel``: for how long the link of each of ``hosts`` was sending."""
        now_ns = self._context.now_ns
        return [self._booked_ns[host] - max(self._free_ns[host] - now_ns, 0) for host in hosts]
