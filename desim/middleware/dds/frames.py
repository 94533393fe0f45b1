"""Frames of a reliable writer other than new samples: bundles, heartbeats, gaps."""

from __future__ import annotations

from typing import TYPE_CHECKING

from desim.middleware.dds.writer_proxy import DIRECTED, NO_HEARTBEAT, ReliableSample
from desim.network.carrier import BEFORE_NS, Carrier

if TYPE_CHECKING:
    from desim.middleware.dds.reader_proxy import ReaderProxy
    from desim.middleware.dds.wire import RtpsVendor

BundleToken = tuple[list[ReliableSample], int, int]  # samples, first number, kind of the heartbeat
HeartbeatToken = tuple[int, int, int]  # first and last number, kind


class BundleCarrier(Carrier[BundleToken]):
    """The carrier of several whole samples in one message, which gets lost with any packet of it
    (Fast DDS, of what it repeats)."""

    socket = "rtps"  # a participant sends all by one

    def __init__(self, proxy: ReaderProxy, wire: RtpsVendor) -> None:
        self._proxy, self._wire = proxy, wire

    def send(self, bundle: list[tuple[ReliableSample, bool]]) -> None:
        """Send samples together; the flag of each: whether a heartbeat rides on it."""
        if bundle:
            proxy, samples = self._proxy, [sample for sample, _ in bundle]
            beats = sum(rides for _, rides in bundle)
            size = self._wire.bundle([sample.message.size_bytes for sample in samples], beats)
            for sample in samples:
                proxy.leaves(sample, size.size_bytes)
            proxy.send(size, self, (samples, proxy.first(), DIRECTED if beats else NO_HEARTBEAT))

    def topics(self, token: BundleToken) -> tuple[str, ...]:
        return (self._proxy.ends[2],)

    def first_sent(self, token: BundleToken, now_ns: int) -> int:
        return token[0][0].first_ns

    def arrived(self, token: BundleToken, receiver: int) -> None:
        samples, first, beat = token
        for sample in samples:
            self._proxy.arrived((sample, range(sample.parts), first,
                                beat if sample is samples[-1] else NO_HEARTBEAT, ()), receiver)

    def arrived_in_part(self, token: BundleToken, receiver: int, lost: dict[int, str]) -> None:
        self.lost(token, receiver, next(iter(lost.values())))

    def lost(self, token: BundleToken, receiver: int, reason: str) -> None:
        for sample in token[0]:
            self._proxy.lose(sample, reason)

    def repeated(self, token: BundleToken, receiver: int) -> None:
        for sample in token[0]:
            self._proxy.discard_copy(sample)


class HeartbeatCarrier(Carrier[HeartbeatToken]):
    """The carrier of heartbeats to one reader. After a lost one another one will come."""

    socket = "rtps"  # a participant sends all by one

    def __init__(self, proxy: ReaderProxy) -> None:
        self._proxy = proxy

    def first_sent(self, token: HeartbeatToken, now_ns: int) -> int:
        return BEFORE_NS

    def arrived(self, token: HeartbeatToken, receiver: int) -> None:
        self._proxy.writer_proxy.heartbeat(*token)

    repeated = arrived
