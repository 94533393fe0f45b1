"""Many senders and one narrow line behind them, with a finite queue in front of it."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from desim import ports
from desim.ports.cases import NOWHERE, Setup
from desim.units import BitRate, ByteSize, Duration, Period
from netmodels.access_link import AccessLink
from netmodels.cases.packets import MOST_UDP_BYTES, PPP_BYTES, UDP_IP_BYTES
from netmodels.cases.senders import flows, measured_span

_PERIODIC = 20_000  # packets: loss within 0.001 of ns-3, delay within 1 % (validation)
_POISSON, _MOST = 75_000, 1_000_000
_NO_BOUND = "1000000 GB"  # of the queue in bytes
_ROUTER, _SINK = "router", "sink"


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

    def __init__(self, params: Params) -> None:
        self._params = params

    def setup(self) -> Setup:
        p = self._params
        size_bytes = p.payload_bytes + UDP_IP_BYTES + PPP_BYTES
        packet_ns = size_bytes * 8e9 / p.capacity_bps
        queue = {} if p.queue is None else {"queue_packets": p.queue}
        link = AccessLink(AccessLink.Params(
            rate=f"{p.capacity_bps} b/s", queue=_NO_BOUND,
            latency=f"{p.latency_ns} ns", **queue))
        span = measured_span(packet_ns, p.load, p.queue or 0, 1, p.senders, self._packets(),
                             p.duration_ns)
        return Setup(link, {_ROUTER: NOWHERE, _SINK: NOWHERE},
                     flows((_ROUTER,) * p.senders, _SINK, size_bytes, p.payload_bytes, p.arrivals,
                           p.senders * packet_ns / p.load, span.backlog),
                     span.duration_ns, span.warm_up_ns)

    def _packets(self) -> int:
        """To measure. The relative variance of a mean wait goes with 1 / (1 - load)^2 (Whitt 1989,
        "Planning queueing simulations")."""
        p = self._params
        if p.arrivals == "periodic":
            return _PERIODIC
        return min(round(_POISSON / max((1 - p.load) ** 2, 1e-3)), _MOST)
