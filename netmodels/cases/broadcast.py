"""Heartbeats that stations of 802.11 broadcast: nobody acknowledges or repeats them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

from pydantic import Field

from desim import ports
from desim.errors import InputError
from desim.ports.cases import NOWHERE, Flow, Setup
from desim.units import NS_PER_S, BitRate, ByteSize, Frequency, Length, Period
from netmodels.cases.traffic import MOST_RADIO_BYTES, SAME_POWER, numbered, udp_bytes
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.standards import StandardName

_TURN_RAD = math.pi * (3 - math.sqrt(5))  # the golden angle


@dataclass(frozen=True)
class HeartbeatBroadcast:
    """Heartbeats that every station broadcasts to all others: the share of copies that arrive
    (delivery_ratio). Of those who wait for the same frame to end, some draw the same slot, and
    their frames are lost; those who send in the same instant collide with certainty."""

    class Params(ports.Params):
        standard: StandardName = Field("11a", description="timing and rates (ns-3 "
                                                                          "reference)")
        rate_bps: BitRate = Field("6 Mb/s", description="of broadcasts (the lowest basic one)")
        stations: int = Field(30, ge=2, le=1000, description="that send and listen (the paper's "
                                                             "largest fleet)")
        payload_bytes: ByteSize = Field("200 B", ge=1, le=MOST_RADIO_BYTES, description=(
            "of UDP (ns-3 reference)"))
        hz: Frequency = Field("10 Hz", description="heartbeats of each station (ns-3 reference)")
        arrivals: Literal["poisson", "periodic", "zero"] = Field("poisson", description=(
            "at random, from random phases, or all at the same instant (ns-3 reference)"))
        radius_m: Length | None = Field(None, gt=0, examples=["20 m"], description=(
            "of the disc over which they are spread evenly (none: all hear each other equally "
            "well)"))
        preset: Literal["ns3_3_44"] | None = Field("ns3_3_44", description=(
            "what the standard leaves open, and where receivers differ from it (ns-3 reference)"))
        duration_ns: Period = Field("40 s", description="that is measured (a few thousand "
                                                        "heartbeats)")

    params: Params

    def setup(self) -> Setup:
        p = self.params
        stations = numbered("station", p.stations)
        rate = f"{p.rate_bps} b/s"
        if p.radius_m is None:
            places, loss = [NOWHERE] * p.stations, SAME_POWER
        else:
            places, loss = sunflower(p.stations, p.radius_m), {"model": "log_distance"}
        radio = DcfRadio(DcfRadio.Params(preset=p.preset, standard=p.standard, rate=rate,
                                         broadcast_rate=rate, path_loss=loss))
        every_ns = round(NS_PER_S / Fraction(p.hz))
        if every_ns > p.duration_ns:
            raise InputError(f".hz: nobody says anything in {p.duration_ns / NS_PER_S:g} s; "
                             "allowed: more often, or a longer --duration")
        return Setup(radio, dict(zip(stations, places, strict=True)),
                     [Flow(station, tuple(other for other in stations if other != station),
                           udp_bytes(p.payload_bytes), p.payload_bytes, p.arrivals, every_ns,
                           broadcast=True)
                      for station in stations], p.duration_ns)


def sunflower(count: int, radius_m: float) -> list[tuple[float, float]]:
    """Places that fill a disc evenly (Vogel 1979): each turned on by the golden angle."""
    distances_m = [radius_m * math.sqrt((k + 0.5) / count) for k in range(count)]
    return [(r * math.cos(k * _TURN_RAD), r * math.sin(k * _TURN_RAD))
            for k, r in enumerate(distances_m)]
