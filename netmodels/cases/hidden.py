"""Two senders at either side of one receiver, which may be too far apart to hear each other."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from desim import ports
from desim.errors import InputError
from desim.ports.cases import Arrivals, Setup
from desim.units import BitRate, ByteSize, Length, Period
from netmodels.cases.packets import MOST_RADIO_BYTES, UDP_IP_BYTES
from netmodels.cases.senders import flows
from netmodels.ethernet import ETHERNET_BYTES
from netmodels.radio.dcf.radio import DcfRadio

_WARM_UP_NS = 500_000_000  # some hundred packets at 6 Mb/s


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
        standard: Literal["11a", "11b", "11g"] = Field("11a", description="timing and rates (ns-3 "
                                                                          "reference)")
        rate_bps: BitRate = Field("6 Mb/s", description="of data (ns-3 reference)")
        payload_bytes: ByteSize = Field("1000 B", ge=1, le=MOST_RADIO_BYTES, description=(
            "of UDP (ns-3 reference)"))
        preset: Literal["ns3_3_44"] | None = Field("ns3_3_44", description=(
            "what the standard leaves open, and where receivers differ from it (ns-3 reference)"))
        duration_ns: Period = Field("20 s", description="that is measured, after half a second")

    def __init__(self, params: Params) -> None:
        self._params = params

    def setup(self) -> Setup:
        p = self._params
        if p.load_bps is not None and p.load_bps > p.rate_bps:
            raise InputError(f".load: {p.load_bps / 1e6:g} Mb/s is more than a sender gets onto "
                             "the air; allowed: at most the rate, or none (saturated)")
        radio = DcfRadio(DcfRadio.Params(preset=p.preset, standard=p.standard,
                                   rate=f"{p.rate_bps} b/s", rts="0 B" if p.rts else None))
        places = {"sender_1": (0.0, 0.0), "receiver": (p.spacing_m, 0.0),
                  "sender_2": (2 * p.spacing_m, 0.0)}
        size_bytes = p.payload_bytes + UDP_IP_BYTES + ETHERNET_BYTES
        arrivals: Arrivals = "saturated" if p.load_bps is None else "poisson"
        every_ns = 0.0 if p.load_bps is None else p.payload_bytes * 8e9 / p.load_bps
        return Setup(radio, places, flows(("sender_1", "sender_2"), "receiver", size_bytes,
                                          p.payload_bytes, arrivals, every_ns),
                     _WARM_UP_NS + p.duration_ns, _WARM_UP_NS)
