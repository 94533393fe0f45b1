"""Many senders at a given load: on one cable, or in front of one narrow line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from pydantic import Field

from desim import ports
from desim.ports.cases import NOWHERE, Setup
from desim.units import BitRate, ByteSize, Duration, Period
from netmodels.access_link import AccessLink
from netmodels.bus import Bus
from netmodels.cases.traffic import MOST_UDP_BYTES, PPP_BYTES, UDP_IP_BYTES, flows, numbered
from netmodels.ethernet import ETHERNET_BYTES

_SETTLING = 2000  # packets until a queue that can carry its load is as full as it usually is

# Packets to measure where arrivals are periodic: loss within 0.001 of ns-3, delay within 1 %; on a
# bus within 0.01 and throughput within 1 % (validation).
_PACKETS = 20_000
_POISSON, _MOST = 75_000, 1_000_000  # at random: see ``Bottleneck.Params.duration_ns``
_NO_BOUND = "1000000 GB"  # of the queue in bytes


@dataclass(frozen=True)
class Bottleneck:
    """Senders of UDP share a line that is slower than theirs, behind a drop-tail queue: what is
    lost, and how long the rest waits. With poisson arrivals and no bound on the queue it is the
    textbook's M/D/1."""

    class Params(ports.Params):
        senders: int = Field(10, ge=1, le=10_000, description="in front of the bottleneck, on fast "
                                                              "lines of their own (a fleet)")
        capacity_bps: BitRate = Field("10 Mb/s", description="of the bottleneck (ns-3 reference)")
        load: float = Field(0.9, ge=1e-3, le=100, allow_inf_nan=False, description=(
            "what all send together, headers included, to the capacity (busy)"))
        queue: int | None = Field(100, ge=0, description=(
            "packets that wait beside the one that is being sent (ns-3 DropTailQueue)"))
        arrivals: Literal["poisson", "periodic"] = Field("poisson", description=(
            "at random, or regularly from random phases (ns-3 reference)"))
        payload_bytes: ByteSize = Field("1472 B", ge=1, le=MOST_UDP_BYTES, description=(
            "of UDP, in 30 B of UDP, IP and PPP (ns-3 reference)"))
        latency_ns: Duration = Field("1 ms", description="of the bottleneck (ns-3 reference)")
        duration_ns: Period | None = Field(None, examples=["10 s"], description=(
            "that is measured, after the queue has settled (what 20000 packets last; at random "
            "75000 / (1 - load)^2, so that chance makes 1 % of the wait, but a million at most)"))

    params: Params

    def setup(self) -> Setup:
        p = self.params
        queue = {} if p.queue is None else {"queue_packets": p.queue}
        link = AccessLink(AccessLink.Params(
            rate=f"{p.capacity_bps} b/s", queue=_NO_BOUND,
            latency=f"{p.latency_ns} ns", **queue))
        return _loaded(p, link, ("router",) * p.senders, UDP_IP_BYTES + PPP_BYTES, p.queue or 0,
                       self._packets())

    def _packets(self) -> int:
        """To measure. The relative variance of a mean wait goes with 1 / (1 - load)^2 (Whitt 1989,
        "Planning queueing simulations")."""
        p = self.params
        if p.arrivals == "periodic":
            return _PACKETS
        return min(round(_POISSON / max((1 - p.load) ** 2, 1e-3)), _MOST)


@dataclass(frozen=True)
class SharedBus:
    """Senders of UDP share one Ethernet cable, each with a drop-tail queue: how much they carry
    together, what is lost and how long the rest takes, by who is allowed to send next."""

    class Params(ports.Params):
        mode: Literal["csma", "csma_cd", "fifo"] = Field("csma", description=(
            "without collisions as in ns-3, with them as in IEEE 802.3, or in order (ns-3 "
            "reference)"))
        senders: int = Field(10, ge=1, le=1000, description="on the cable (a fleet)")
        capacity_bps: BitRate = Field("10 Mb/s", description="of the cable (ns-3 reference)")
        load: float = Field(0.9, ge=1e-3, le=100, allow_inf_nan=False, description=(
            "what all send together, headers included, to the capacity (busy)"))
        queue: int = Field(100, ge=1, description=(
            "packets that wait at a sender beside the one that is being sent; with fifo in all "
            "(ns-3 DropTailQueue)"))
        arrivals: Literal["poisson", "periodic"] = Field("poisson", description=(
            "at random, or regularly from random phases (ns-3 reference)"))
        payload_bytes: ByteSize = Field("1472 B", ge=1, le=MOST_UDP_BYTES, description=(
            "of UDP, in 46 B of UDP, IP and Ethernet (ns-3 reference)"))
        propagation_ns: Duration = Field("1 us", description="of the cable (ns-3 reference)")
        preamble_bytes: ByteSize | None = Field(None, examples=["8 B"], description=(
            "before each packet (8 B, IEEE 802.3; csma: 0 B as in ns-3)"))
        duration_ns: Period | None = Field(None, examples=["10 s"], description=(
            "that is measured, after the queues have settled (what 20000 packets last)"))

    params: Params

    def setup(self) -> Setup:
        p = self.params
        preamble_bytes = p.preamble_bytes
        if preamble_bytes is None:
            preamble_bytes = 0 if p.mode == "csma" else 8
        bus = Bus(Bus.Params(
            arbitration=p.mode, rate=f"{p.capacity_bps} b/s", queue_packets=p.queue,
            propagation=f"{p.propagation_ns} ns", preamble=f"{preamble_bytes} B"))
        queues = 1 if p.mode == "fifo" else p.senders
        return _loaded(p, bus, numbered("sender", p.senders), UDP_IP_BYTES + ETHERNET_BYTES,
                       queues * p.queue, _PACKETS)


def _loaded(p: Bottleneck.Params | SharedBus.Params, model: ports.NetworkModel,
            sources: tuple[str, ...], header_bytes: int, queued: int, packets: int) -> Setup:
    """Equal flows from ``sources`` to a sink. The warm-up lasts until queues of ``queued`` packets
    in all are in a steady state and have sent what they began with; then ``packets`` are measured,
    or ``duration``. Under overload each sender begins with a backlog, so that queues are full at
    once."""
    size_bytes = p.payload_bytes + header_bytes
    packet_ns = size_bytes * 8e9 / p.capacity_bps
    each_ns, waiting = packet_ns / min(p.load, 1), queued if p.load > 1 else 0
    warm_up_ns = round((_SETTLING + waiting) * each_ns)
    return Setup(model, dict.fromkeys((*sources, "sink"), NOWHERE),
                 flows(sources, "sink", size_bytes, p.payload_bytes, p.arrivals,
                       p.senders * packet_ns / p.load, -(-waiting // p.senders)),
                 warm_up_ns + (p.duration_ns or round(packets * each_ns)), warm_up_ns)
