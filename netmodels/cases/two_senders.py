"""Two stations that send: to one receiver between them, or to one each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from pydantic import Field

from desim import ports
from desim.errors import InputError
from desim.ports.cases import Arrivals, Flow, Setup
from desim.units import BitRate, ByteSize, Length, Period
from netmodels.cases.traffic import MOST_RADIO_BYTES, flows, udp_bytes
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.standards import StandardName

_WARM_UP_NS = 500_000_000  # some hundred packets at 6 Mb/s


@dataclass(frozen=True)
class Hidden:
    """Two stations with a receiver in their middle, in the open (log-distance). Once they do not
    hear each other (beyond 25.7 m of spacing) they are hidden terminals and send into each other's
    frames; RTS and CTS help. (With RTS a failed request counts among the failures, but not among
    the attempts to send data.)"""

    class Params(ports.Params):
        spacing_m: Length = Field("40 m", description="from each sender to the receiver (hidden)")
        rts: bool = Field(False, description="ask before each packet (ns-3: off)")
        load_bps: BitRate | None = Field(None, examples=["1 Mb/s"], description=(
            "of payload from each sender, at random times (saturated)"))
        standard: StandardName = Field("11a", description="timing and rates (ns-3 "
                                                                          "reference)")
        rate_bps: BitRate = Field("6 Mb/s", description="of data (ns-3 reference)")
        payload_bytes: ByteSize = Field("1000 B", ge=1, le=MOST_RADIO_BYTES, description=(
            "of UDP (ns-3 reference)"))
        preset: Literal["ns3_3_44"] | None = Field("ns3_3_44", description=(
            "what the standard leaves open, and where receivers differ from it (ns-3 reference)"))
        duration_ns: Period = Field("20 s", description="that is measured, after half a second")

    params: Params

    def setup(self) -> Setup:
        p = self.params
        if p.load_bps is not None and p.load_bps > p.rate_bps:
            raise InputError(f".load: {p.load_bps / 1e6:g} Mb/s is more than a sender gets onto "
                             "the air; allowed: at most the rate, or none (saturated)")
        places = {"sender_1": (0.0, 0.0), "receiver": (p.spacing_m, 0.0),
                  "sender_2": (2 * p.spacing_m, 0.0)}
        arrivals: Arrivals = "saturated" if p.load_bps is None else "poisson"
        every_ns = 0.0 if p.load_bps is None else p.payload_bytes * 8e9 / p.load_bps
        radio = DcfRadio(DcfRadio.Params(preset=p.preset, standard=p.standard,
                                         rate=f"{p.rate_bps} b/s", rts="0 B" if p.rts else None))
        return Setup(radio, places,
                     flows(("sender_1", "sender_2"), "receiver", udp_bytes(p.payload_bytes),
                           p.payload_bytes, arrivals, every_ns),
                     _WARM_UP_NS + p.duration_ns, _WARM_UP_NS)


@dataclass(frozen=True)
class TwoPairs:
    """Two saturated pairs side by side, in the open (log-distance): nearer than carrier sense
    reaches they take turns, farther apart both send at once, and in between they disturb each
    other."""

    class Params(ports.Params):
        distance_m: Length = Field("40 m", description="between the pairs (within carrier sense)")
        length_m: Length = Field("10 m", description="from a sender to its receiver (ns-3 "
                                                     "reference)")
        standard: StandardName = Field("11a", description="timing and rates (ns-3 "
                                                                          "reference)")
        rate_bps: BitRate = Field("6 Mb/s", description="of data (ns-3 reference)")
        payload_bytes: ByteSize = Field("1000 B", ge=1, le=MOST_RADIO_BYTES, description=(
            "of UDP (ns-3 reference)"))
        preset: Literal["ns3_3_44"] | None = Field("ns3_3_44", description=(
            "what the standard leaves open, and where receivers differ from it (ns-3 reference)"))
        duration_ns: Period = Field("10 s", description="that is measured, after half a second")

    params: Params

    def setup(self) -> Setup:
        p = self.params
        places = {"sender_1": (0.0, 0.0), "receiver_1": (p.length_m, 0.0),
                  "sender_2": (0.0, p.distance_m), "receiver_2": (p.length_m, p.distance_m)}
        radio = DcfRadio(DcfRadio.Params(preset=p.preset, standard=p.standard,
                                         rate=f"{p.rate_bps} b/s"))
        return Setup(radio, places,
                     [Flow(f"sender_{k}", (f"receiver_{k}",), udp_bytes(p.payload_bytes),
                           p.payload_bytes) for k in (1, 2)],
                     _WARM_UP_NS + p.duration_ns, _WARM_UP_NS)
