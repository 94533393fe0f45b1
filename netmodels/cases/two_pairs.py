"""Two senders with a receiver each, near or far from each other: who shares the air, who reuses it.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from desim import ports
from desim.ports.cases import Flow, Setup
from desim.units import BitRate, ByteSize, Length, Period
from netmodels.cases.packets import MOST_RADIO_BYTES, UDP_IP_BYTES
from netmodels.ethernet import ETHERNET_BYTES
from netmodels.radio.dcf.radio import DcfRadio

_WARM_UP_NS = 500_000_000  # some hundred packets at 6 Mb/s


class TwoPairs:
    """Two saturated pairs side by side, in the open (log-distance): nearer than carrier sense
    reaches they take turns, farther apart both send at once, and in between they disturb each
    other."""

    class Params(ports.Params):
        distance_m: Length = Field("40 m", description="between the pairs (within carrier sense)")
        length_m: Length = Field("10 m", description="from a sender to its receiver (ns-3 "
                                                     "reference)")
        standard: Literal["11a", "11b", "11g"] = Field("11a", description="timing and rates (ns-3 "
                                                                          "reference)")
        rate_bps: BitRate = Field("6 Mb/s", description="of data (ns-3 reference)")
        payload_bytes: ByteSize = Field("1000 B", ge=1, le=MOST_RADIO_BYTES, description=(
            "of UDP (ns-3 reference)"))
        preset: Literal["ns3_3_44"] | None = Field("ns3_3_44", description=(
            "what the standard leaves open, and where receivers differ from it (ns-3 reference)"))
        duration_ns: Period = Field("10 s", description="that is measured, after half a second")

    def __init__(self, params: Params) -> None:
        self._params = params

    def setup(self) -> Setup:
        p = self._params
        radio = DcfRadio(DcfRadio.Params(preset=p.preset, standard=p.standard,
                                   rate=f"{p.rate_bps} b/s"))
        places = {"sender_1": (0.0, 0.0), "receiver_1": (p.length_m, 0.0),
                  "sender_2": (0.0, p.distance_m), "receiver_2": (p.length_m, p.distance_m)}
        size_bytes = p.payload_bytes + UDP_IP_BYTES + ETHERNET_BYTES
        return Setup(radio, places,
                     [Flow(f"sender_{k}", (f"receiver_{k}",), size_bytes, p.payload_bytes)
                      for k in (1, 2)], _WARM_UP_NS + p.duration_ns, _WARM_UP_NS)
