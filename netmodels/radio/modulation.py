"""The standard of a radio and how fast it sends, as parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from pydantic import Field

from desim import ports
from desim.errors import InputError
from desim.units import ByteSize, Carrier, Period
from netmodels.radio.access_categories import AccessCategory, categories
from netmodels.radio.high_throughput import (
    FORMATS,
    MOST_STREAMS,
    high_throughput,
    mcs_index,
    with_fewer_streams,
)
from netmodels.radio.standards import (
    FIVE_GHZ,
    STANDARDS,
    Access,
    RadioName,
    Standard,
    chosen_rates,
)

USUAL_HZ, USUAL_BPS = 20e6, 54_000_000
_MOST_HT_AMSDU_BYTES = 4065  # (802.11-2016, 9.3.2.2.2)


class Modulation(ports.Params):
    """The standard, and the MCS of those that have it."""

    standard: RadioName = Field("11g", description=(
        "timing and rates (2.4 GHz as most robots); 11n and 11ax are in 2.4 GHz on channels up to "
        "14, above and with 11ac in 5 GHz"))
    mcs: int | None = Field(None, ge=0, le=11, description=(
        "of unicast frames of 11n, 11ac, 11ax, in the place of rate (the highest)"))
    streams: int = Field(1, ge=1, le=MOST_STREAMS, description="of 11n, 11ac, 11ax (1: of the "
                                                               "smallest cards)")
    width_hz: Carrier = Field("20 MHz", description="of the channel of 11n, 11ac, 11ax (20 MHz: "
                                                    "what all have)")
    guard_interval_ns: Period | None = Field(None, examples=["400 ns"], description=(
        "of 11n and 11ac 800 or 400 ns, of 11ax 800, 1600 or 3200 ns (800 ns)"))
    aggregation: bool = Field(True, description="of packets of 11n, 11ac, 11ax in one frame "
                                                "(A-MPDU, which all cards do)")
    amsdu_bytes: ByteSize | None = Field(None, ge=1, le=11_398, examples=["3839 B"], description=(
        "packets in a row go as one, an A-MSDU of at most so many bytes, and are lost together "
        "(null: none, as mac80211 unless a driver sets TX_AMSDU)"))

    qos: bool = Field(False, description=(
        "11a, 11b, 11g with access categories (WMM), as later ones have them always (false: as "
        "before 2005)"))
    access_category: AccessCategory = Field("best_effort", description=(
        "of what has no mark (dscp): background, best_effort, video, voice (best effort)"))

    @property
    def has_mcs(self) -> bool:
        """Whether the standard is 802.11n or later."""
        return self.standard in FORMATS

    def shown(self) -> dict[str, str]:
        """``ports.cases.ShowsSettings``: the rate of the MCS. Raises ``InputError`` for what the
        standard does not have."""
        if not self.has_mcs:
            return {}
        standard = high_throughput(self.standard, round(self.width_hz / 1e6), self.streams,
                                   self.guard_interval_ns, FIVE_GHZ)
        used = standard.rates[mcs_index(self.standard, standard, self.mcs)]
        return {"rate": f"{used.mbps:g} Mb/s"}

    def of_channel(self, channel: int, basic_rates_bps: Sequence[int] | None,
                   fewer_streams: bool = False) -> Standard:
        """The standard's numbers, also with ``fewer_streams`` than the given ones. Raises
        ``InputError`` for what it does not have."""
        if self.has_mcs:
            self._check_amsdu()
            width_mhz, shape = round(self.width_hz / 1e6), (self.streams, self.guard_interval_ns)
            standard = high_throughput(self.standard, width_mhz, *shape, channel)
            if fewer_streams:
                standard = with_fewer_streams(standard, self.standard, width_mhz, *shape)
        else:
            self._refuse()
            standard = STANDARDS[self.standard]
            if self.qos:
                standard = replace(standard, aifsn=3, qos_bytes=2)
        return standard.with_basic(self.standard, basic_rates_bps)

    def _check_amsdu(self) -> None:
        if self.amsdu_bytes is None:
            return
        if not self.aggregation:
            raise InputError(".amsdu: only within aggregates; not with aggregation: false")
        if self.standard == "11n" and self.amsdu_bytes > _MOST_HT_AMSDU_BYTES:
            raise InputError(f".amsdu: 11n has at most {_MOST_HT_AMSDU_BYTES} B within aggregates")

    def _refuse(self) -> None:
        for key, given in (("mcs", self.mcs is not None), ("streams", self.streams > 1),
                           ("width", self.width_hz != USUAL_HZ),
                           ("amsdu", self.amsdu_bytes is not None),
                           ("guard_interval", self.guard_interval_ns is not None),
                           ("access_category",
                            not self.qos and self.access_category != "best_effort")):
            if given:
                or_qos = " and with qos: true" if key == "access_category" else ""
                raise InputError(f".{key}: {self.standard} has none; allowed with "
                                 f"{', '.join(FORMATS)}{or_qos}")

    def access(self, standard: Standard) -> Access:
        """The stations' access to the medium."""
        if not standard.qos_bytes:
            return standard.access
        return next(one for one in categories(standard) if one.name == self.access_category)

    def rates_of(self, standard: Standard, rate_bps: int, broadcast_rate_bps: int | None
                 ) -> tuple[int, int]:
        """The rates of unicast and of broadcast frames, as indices of ``standard.rates``. Raises
        ``InputError`` for those that it does not have."""
        if not self.has_mcs:
            return chosen_rates(standard, self.standard, rate_bps, broadcast_rate_bps)
        if rate_bps != USUAL_BPS:
            raise InputError(f".rate: {self.standard} has an mcs instead")
        slowest = standard.rate(6) if broadcast_rate_bps is None else standard.legacy_rate(
            self.standard, "broadcast_rate", broadcast_rate_bps)
        return mcs_index(self.standard, standard, self.mcs), slowest
