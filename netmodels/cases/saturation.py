"""Saturated stations of 802.11: the goodput of stations that always have something to send."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from pydantic import Field

from desim.errors import InputError
from desim.ports.cases import NOWHERE, Flow, Setup
from desim.units import BitRate, ByteSize, Period, airtime_ns
from netmodels.cases.traffic import MOST_80211_BYTES, SAME_POWER, UDP_IP_BYTES, numbered
from netmodels.ethernet import ETHERNET_BYTES
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.dcf.stations import Aggregation
from netmodels.radio.modulation import Modulation
from netmodels.radio.standards import FIVE_GHZ, STANDARDS

_FRAMES = 50_000  # that the rate could carry in the time that is measured
_WARM_UP = 0.1  # of that time


@dataclass(frozen=True)
class Saturation:
    """Saturated stations of 802.11 that all hear each other equally well: goodput, collisions and
    drops of the distributed coordination function. Nobody's frame is stronger, so that of two that
    begin together both are lost."""

    class Params(Modulation):
        rate_bps: BitRate | None = Field(None, examples=["54 Mb/s"], description=(
            "of data (the standard's highest)"))
        stations: int = Field(10, ge=1, le=1000, description="that send (a fleet)")
        payload_bytes: ByteSize = Field("1000 B", ge=1, le=MOST_80211_BYTES, description=(
            "of a packet (ns-3 reference)"))
        headers_bytes: ByteSize | None = Field(None, examples=["28 B"], description=(
            "between payload and 802.11 (28 B of UDP and IP; 11b: 0 B, as in its published table)"))
        topology: Literal["sink", "pairs"] = Field("sink", description="one receiver for all, or "
                                                                       "one each (ns-3 reference)")
        slot_ns: Period | None = Field(None, examples=["9 us"], description=(
            "of the backoff (the standard's: 9 us; 20 us with 11b and, where 11b may be, 11g)"))
        basic_rates_bps: tuple[BitRate, ...] = Field((), examples=["2 Mb/s"], description=(
            "of which acknowledgements have the highest that is not above the data's; can be given "
            "again (the standard's mandatory ones)"))
        preset: Literal["ns3_3_44"] | None = Field("ns3_3_44", description=(
            "what the standard leaves open, and where receivers differ from it (ns-3 reference)"))
        duration_ns: Period | None = Field(None, examples=["10 s"], description=(
            "that is measured, after a tenth of it (what 50000 packets last at the rate)"))

    params: Params

    def setup(self) -> Setup:
        p = self.params
        headers_bytes = p.headers_bytes
        if headers_bytes is None:
            headers_bytes = 0 if p.standard == "11b" else UDP_IP_BYTES
        if p.payload_bytes + headers_bytes > MOST_80211_BYTES:
            key = "payload" if p.headers_bytes is None else "headers"
            raise InputError(f".{key}: {p.payload_bytes} B of payload and {headers_bytes} B of "
                             f"headers are too long for 802.11; at most {MOST_80211_BYTES} B")
        size_bytes = p.payload_bytes + headers_bytes + ETHERNET_BYTES
        params = self._radio()
        standard, (rate, _) = params.of_standard(), params.rates()
        duration_ns = p.duration_ns or _FRAMES * airtime_ns(
            size_bytes, round(1e6 * standard.rates[rate].mbps))
        warm_up_ns = round(_WARM_UP * duration_ns)
        senders = numbered("sender", p.stations)
        receivers = (numbered("receiver", p.stations) if p.topology == "pairs"
                     else ("sink",) * p.stations)
        radio = DcfRadio(params, replace(standard, slot_ns=p.slot_ns or standard.slot_ns))
        backlog = 2 * Aggregation().packets if params.aggregated() else 0
        if params.amsdu_bytes is not None:
            backlog = params.queue
        return Setup(radio, dict.fromkeys((*senders, *receivers), NOWHERE),
                     [Flow(sender, (receiver,), size_bytes, p.payload_bytes, backlog=backlog)
                      for sender, receiver in zip(senders, receivers, strict=True)],
                     warm_up_ns + duration_ns, warm_up_ns)

    def _radio(self) -> DcfRadio.Params:
        given = self.params.model_dump(by_alias=True, exclude_none=True, include={
            *Modulation.model_fields, "preset", "rate_bps"})
        if self.params.basic_rates_bps:
            given["basic_rates"] = [f"{bps} b/s" for bps in self.params.basic_rates_bps]
        if self.params.has_mcs:
            given["channel"] = FIVE_GHZ
        elif "rate" not in given:
            highest_mbps = STANDARDS[self.params.standard].rates[-1].mbps
            given["rate"] = f"{highest_mbps} Mb/s"
        return DcfRadio.Params(path_loss=SAME_POWER, **given)
