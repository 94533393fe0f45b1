"""Background traffic on a medium: packets from a host outside of the fleet to another host.

It occupies the medium as any frame does, and nobody reads it. Packets that are due within a short
while go as one train: none is sent late, and none more than this while too early.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from desim.engine.kernel import Kernel, Phase
from desim.engine.trace import Trace
from desim.network.carrier import Carrier
from desim.network.medium import Medium
from desim.units import NS_PER_S

_CHUNK = 1024  # packets whose times are drawn together


class Spells(NamedTuple):
    """The mean times of a sender that is on and off in turn, both exponential."""

    on_ns: int
    off_ns: int


def periodic(size_bytes: int, rate_bps: int, stream: np.random.Generator) -> Iterator[np.ndarray]:
    """The times (ns) of packets of ``size_bytes`` at ``rate_bps``, in arrays: equally far apart,
    the first one after a random part of the period."""
    ns_times_rate = 8 * size_bytes * NS_PER_S
    base_ns, rest = int(stream.integers(max(1, ns_times_rate // rate_bps))), 0
    while True:
        steps = (rest + np.arange(_CHUNK) * ns_times_rate) // rate_bps
        yield base_ns + steps
        ahead_ns, rest = divmod(rest + _CHUNK * ns_times_rate, rate_bps)
        base_ns += ahead_ns


def poisson(size_bytes: int, rate_bps: int, stream: np.random.Generator) -> Iterator[np.ndarray]:
    """The same with exponential times between packets."""
    mean_ns, base_ns = 8 * size_bytes * NS_PER_S / rate_bps, 0
    while True:
        times = base_ns + np.rint(np.cumsum(mean_ns * stream.standard_exponential(_CHUNK))
                                  ).astype(np.int64)
        yield times
        base_ns = int(times[-1])


def on_off(size_bytes: int, rate_bps: int, stream: np.random.Generator,
           spells: Spells) -> Iterator[np.ndarray]:
    """The same in spells, with the mean ``rate_bps`` over all time; equally far apart while on."""
    on_ns, off_ns = spells
    period_ns = 8 * size_bytes * NS_PER_S / rate_bps * on_ns / (on_ns + off_ns)
    begin_ns = 0.0
    if stream.random() * (on_ns + off_ns) >= on_ns:
        begin_ns = off_ns * stream.standard_exponential()
    while True:
        end_ns = begin_ns + on_ns * stream.standard_exponential()
        times = np.arange(begin_ns + period_ns * stream.random(), end_ns, period_ns)
        if len(times):
            yield np.rint(times).astype(np.int64)
        begin_ns = end_ns + off_ns * stream.standard_exponential()


def trains(arrays: Iterator[np.ndarray], grain_ns: int) -> Iterator[tuple[int, int]]:
    """(ns, packets) of trains: each begins with a packet and takes those that are due within
    ``grain_ns`` (0: none) along."""
    times = next(arrays)
    while True:
        begin_ns = int(times[0])
        while (count := int(np.searchsorted(times, begin_ns + grain_ns))) == len(times):
            times = np.concatenate((times, next(arrays)))
        count = max(1, count)
        yield begin_ns, count
        times = times[count:]
        if not len(times):
            times = next(arrays)


class BackgroundFlow(Carrier[int]):
    """Trains of packets of ``size_bytes`` from host ``source`` to host ``receiver`` (indices of
    ``medium``; ``between``: their names), at the ``times`` of ``trains`` counted from ``begin_ns``,
    before ``until_ns`` (None: for good). The token of a train is the number of its packets.

    Counts packets, which are conserved: sent = delivered + dropped by reason + in flight. Each
    train is a trace row ``background`` (entity: the medium; a, b: sender and receiver; c: packets).
    """

    def __init__(self, medium: Medium, source: int, receiver: int, between: tuple[str, str],
                 size_bytes: int, times: Iterator[tuple[int, int]], kernel: Kernel, trace: Trace,
                 begin_ns: int = 0, until_ns: int | None = None) -> None:
        self.medium, self.source, self.receiver, self.between = medium, source, receiver, between
        self.sent = self.delivered = 0
        self.dropped: Counter[str] = Counter()
        self._source_id, self._receiver_id = map(trace.names.id, between)
        self._size_bytes, self._times = size_bytes, times
        self._begin_ns, self._until_ns = begin_ns, until_ns
        self._kernel, self._trace = kernel, trace
        self._row = trace.names.id("background")
        self._book()

    @property
    def in_flight(self) -> int:
        """Packets without a fate."""
        return self.sent - self.delivered - sum(self.dropped.values())

    def arrived(self, packets: int, receiver: int) -> None:
        self.delivered += packets

    def arrived_in_part(self, packets: int, receiver: int, lost: dict[int, str]) -> None:
        self.delivered += packets - len(lost)
        self.dropped.update(lost.values())

    def lost(self, packets: int, receiver: int, reason: str) -> None:
        self.dropped[reason] += packets

    def _book(self) -> None:
        time_ns, packets = next(self._times)
        time_ns += self._begin_ns
        if self._until_ns is None or time_ns < self._until_ns:
            self._kernel.at(time_ns, Phase.NETWORK, self._source_id, self._send, packets)

    def _send(self, packets: int) -> None:
        self.sent += packets
        self._trace.row(self._kernel.now_ns, self._row, self.medium.id, self._source_id,
                        self._receiver_id, packets)
        self.medium.transmit(self.source, (self.receiver,), packets * self._size_bytes, packets,
                             False, self, packets)
        self._book()
