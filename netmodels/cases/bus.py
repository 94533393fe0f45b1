"""Many senders on one cable."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from desim import ports
from desim.ports.cases import NOWHERE, Setup
from desim.units import BitRate, ByteSize, Duration, Period
from netmodels.bus import Bus
from netmodels.cases.packets import MOST_UDP_BYTES, UDP_IP_BYTES
from netmodels.cases.senders import flows, measured_span, numbered
from netmodels.ethernet import ETHERNET_BYTES

_PACKETS = 20_000  # to measure: loss within 0.01 of ns-3, throughput within 1 % (validation)


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

    def __init__(self, params: Params) -> None:
        self._params = params

    def setup(self) -> Setup:
        p = self._params
        size_bytes = p.payload_bytes + UDP_IP_BYTES + ETHERNET_BYTES
        packet_ns = size_bytes * 8e9 / p.capacity_bps
        preamble_bytes = p.preamble_bytes
        if preamble_bytes is None:
            preamble_bytes = 0 if p.mode == "csma" else 8
        bus = Bus(Bus.Params(
            arbitration=p.mode, rate=f"{p.capacity_bps} b/s", queue_packets=p.queue,
            propagation=f"{p.propagation_ns} ns", preamble=f"{preamble_bytes} B"))
        queues = 1 if p.mode == "fifo" else p.senders
        span = measured_span(packet_ns, p.load, p.queue, queues, p.senders, _PACKETS, p.duration_ns)
        senders = numbered("sender", p.senders)
        return Setup(bus, dict.fromkeys((*senders, "sink"), NOWHERE),
                     flows(senders, "sink", size_bytes, p.payload_bytes, p.arrivals,
                           p.senders * packet_ns / p.load, span.backlog),
                     span.duration_ns, span.warm_up_ns)
