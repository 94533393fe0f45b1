"""Radios at chosen places, and their flows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from pydantic import Field, model_validator

from desim import ports
from desim.errors import InputError
from desim.ports.antenna import Antenna
from desim.ports.cases import Flow, Setup
from desim.ports.terrain import Walled
from desim.units import BitRate, ByteSize, Duration, Period
from netmodels.cases.traffic import MOST_RADIO_BYTES, udp_bytes
from netmodels.radio.cards import with_card
from netmodels.radio.dcf.stations import Aggregation
from netmodels.radio.high_throughput import FORMATS
from netmodels.radio.modulation import USUAL_BPS
from netmodels.radio.radio import Radio
from netmodels.radio.standards import RadioName

_FAR_M = 1e6  # the farthest place: floats resolve 1e-9 m there


class FlowParams(ports.Params):
    """The packets of one host for another one, over others, or for all. Hosts are named by their
    number in the list of places, from 0."""

    source: int = Field(alias="from", ge=0, description="the number of the host that sends, from 0")
    to: int | None = Field(None, ge=0, description=(
        "the number of the host that receives (none)"))
    via: tuple[int, ...] = Field((), description=(
        "numbers of hosts that pass the packets on, in order; without to, the last one receives "
        "(none)"))
    broadcast: bool = Field(False, description="to all that hear it, not acknowledged (false)")
    protocol: Literal["udp", "tcp"] = Field("udp", description=(
        "tcp: messages over a connection, as Linux's TCP carries them (ns-3 reference)"))
    payload_bytes: ByteSize = Field("1000 B", ge=1, le=10**9, description=(
        "of a packet of UDP, or of a message over TCP (ns-3 reference)"))
    arrivals: Literal["saturated", "periodic", "poisson"] = Field("saturated", description=(
        "two packets for each hop are on the way at any time, two aggregates more where there are "
        "any (tcp: whatever the socket takes), or one every period, from a random phase on or at "
        "random times (the most that it can carry)"))
    period_ns: Period | None = Field(None, description="between packets, on the average (none)")

    def path(self) -> tuple[int, ...]:
        """The hosts on the way of a unicast packet, from its sender to its receiver."""
        return (self.source, *self.via, *(() if self.to is None else (self.to,)))


@dataclass(frozen=True)
class Layout:
    """Hosts with radios at given places or on given ways, in the open or between walls, with given
    flows: who shares the air with whom, who is hidden from whom, what is relayed. Hosts are called
    ``host_0``, ``host_1``, ... in the order of their places. The file has all keys of the radio,
    too."""

    class Params(Radio.Params):
        standard: RadioName = Field("11a", description="timing and rates (ns-3 reference)")
        rate_bps: BitRate = Field("12 Mb/s", description="of unicast packets (ns-3 reference)")
        places: tuple[tuple[float, float], ...] = Field(min_length=2, max_length=1000, description=(
            "of the hosts, [x, y] in m"))
        flows: tuple[FlowParams, ...] = Field(min_length=1, max_length=10_000, description=(
            "who sends what to whom"))
        terrain: Walled = Field(Walled(), description="what stands between the hosts (nothing)")
        motion: dict[str, tuple[tuple[Duration, float, float], ...]] = Field({}, description=(
            "by host, way points [time, x, y] in m: from its place it goes straight to each in "
            "turn, to be there at its time, and stays at the last (none)"))
        antennas: dict[str, Antenna] = Field({}, description="by host (as a robot's)")
        warm_up_ns: Period = Field("1 s", description="that is not measured (ns-3 reference)")
        duration_ns: Period = Field("10 s", description="that is measured, after the warm-up "
                                                        "(ns-3 reference)")

        @model_validator(mode="before")
        @classmethod
        def _spelled_out(cls, given: object) -> object:
            """The radio's presets see the standard, that of its card if it has one, which has no
            ``rate`` of ours beside its ``mcs``; ``rts`` may be true or false."""
            given = with_card(given)
            if not isinstance(given, dict):
                return given
            rts = given.get("rts")
            usual = {"rate": f"{USUAL_BPS} b/s"} if str(given.get("standard")) in FORMATS else {}
            return {"standard": "11a", **usual, **given,
                    **({"rts": "0 B" if rts else None} if isinstance(rts, bool) else {})}

    params: Params

    def setup(self) -> Setup:
        p = self.params
        wrong = [*self._misplaced(), *(f".flows.{k}{line}" for k, flow in enumerate(p.flows)
                                       for line in _complaints(flow, len(p.places), p.fidelity))]
        wrong += [f"{key}: it has no effect, because {unused.why}; allowed: without it"
                  for unused in p.without_effect(None) for key in unused.keys]
        if wrong:
            raise InputError(*wrong)
        hosts = tuple(f"host_{k}" for k in range(len(p.places)))
        aggregates = 2 * Aggregation().packets if p.fidelity == "mac" and p.aggregated() else 0
        return Setup(Radio.build(p), dict(zip(hosts, p.places, strict=True)),
                     [_flow(flow, hosts, aggregates) for flow in p.flows],
                     p.warm_up_ns + p.duration_ns, p.warm_up_ns, terrain=p.terrain,
                     motion=p.motion, antennas=p.antennas)

    def _misplaced(self) -> Iterator[str]:
        places = [(f"places.{k}", place) for k, place in enumerate(self.params.places)]
        stops = [(f"motion.{host}.{k}", way_point[1:])
                 for host, way in self.params.motion.items() for k, way_point in enumerate(way)]
        for key, place in places + stops:
            if not all(abs(x) <= _FAR_M for x in place):
                yield f".{key}: allowed: -{_FAR_M:g} to {_FAR_M:g} m"


def _complaints(flow: FlowParams, hosts: int, fidelity: str) -> Iterator[str]:
    """The reasons why a flow cannot be played; a line begins with its key, or is about the
    whole."""
    for key, numbers in (("from", [flow.source]), ("via", flow.via),
                         ("to", [] if flow.to is None else [flow.to])):
        for number in numbers:
            if not 0 <= number < hosts:
                yield f".{key}: there is no host {number}; allowed: 0 to {hosts - 1}"
    if flow.protocol == "tcp":
        for key in "via", "broadcast":
            if getattr(flow, key):
                yield (f".{key}: TCP goes from one host to another one; allowed: protocol: udp, or "
                       "fidelity: multihop, in which hosts relay")
    elif flow.payload_bytes > MOST_RADIO_BYTES:
        yield (f".payload: a packet of UDP has at most {MOST_RADIO_BYTES} B, got "
               f"{flow.payload_bytes} B; allowed: less, or protocol: tcp")
    path = flow.path()
    if flow.broadcast and len(path) > 1:
        yield ".broadcast: it goes to all, so there is neither to nor via"
    if not flow.broadcast and len(path) < 2:
        yield ": nobody receives it; allowed: to, via or broadcast: true"
    if len(set(path)) < len(path):
        yield f": it comes to a host twice: {', '.join(map(str, path))}"
    if flow.arrivals == "saturated":
        if fidelity == "ideal":
            yield (".arrivals: where all arrives at once a saturated flow has no end; allowed: "
                   "periodic, poisson")
        if flow.broadcast:
            yield ".arrivals: broadcasts have a period; allowed: periodic, poisson"
        if flow.period_ns is not None:
            yield ".period: a saturated flow has none; allowed: arrivals: periodic, poisson"
    elif flow.period_ns is None:
        yield f".arrivals: {flow.arrivals} packets need a period, e.g. period: 20 ms"


def _flow(flow: FlowParams, hosts: tuple[str, ...], aggregates: int) -> Flow:
    """``aggregates``: packets of a saturated flow beside two for each hop."""
    source, *others = (hosts[number] for number in flow.path())
    receivers = (tuple(host for host in hosts if host != source) if flow.broadcast
                 else tuple(others[-1:]))
    saturated = flow.arrivals == "saturated" and flow.protocol == "udp"
    return Flow(source, receivers, udp_bytes(flow.payload_bytes),
                flow.payload_bytes, flow.arrivals, flow.period_ns or 0,
                backlog=2 * len(others) - 2 + aggregates if saturated else 0,
                broadcast=flow.broadcast, via=tuple(others[:-1]), protocol=flow.protocol)
