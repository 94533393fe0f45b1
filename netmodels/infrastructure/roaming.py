"""Roaming: when a station looks for another access point, and when it goes there."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from desim import ports
from desim.units import Decibels, Level, Period

# The rule of wpa_supplicant 2.10 (events.c, wpa_supplicant_need_to_roam_within_ess). The least gain
# of a change by the present signal: below the level, dB; less, where the rate that is expected is
# so many times the present one.
_GAIN_DB = ((-85, 1), (-80, 2), (-75, 3), (-70, 4))
_STRONG_DB = 5
_LESS_DB = ((1.5, 10), (1.2, 5), (1.1, 2), (1.0, 1))
_FASTER_MBPS = 5.0  # a change for the rate alone
_GREAT_DB = 25  # signal above noise that is good enough
_NOISE_DBM = -89, -92  # at 2.4 and 5 GHz (DEFAULT_NOISE_FLOOR_2GHZ, _5GHZ)
_SNR_DB = 0, 2, 5, 9, 10, 14, 15, 18, 20, 25
_MBPS = 0.0, 6.5, 13.0, 19.5, 24.0, 36.0, 39.0, 52.0, 58.5, 65.0


class Roaming(ports.Params):
    """Background scans as wpa_supplicant's ``bgscan simple`` has them: often while the signal is
    weak, at once when it gets weak or 4 dB weaker, and seldom while it is strong."""

    threshold_dbm: Level = Field("-65 dBm", le=0.0, description=(
        "of the own access point, below which a signal is weak (NetworkManager: simple:30:-65:300)"
        ))
    often_ns: Period | None = Field("30 s", description=(
        "between scans while the signal is weak (NetworkManager; null: no scans)"))
    seldom_ns: Period | None = Field("300 s", description=(
        "between scans while it is strong (NetworkManager; null: no scans)"))
    better_db: Decibels | None = Field(None, description=(
        "by which another one has to be stronger (wpa_supplicant: 1 to 5 dB by the present signal, "
        "less where a higher rate is expected, never above 25 dB of noise)"))
    scan: Literal["all", "known"] = Field("all", description=(
        "channels that a scan visits, all or those of the access points (wpa_supplicant without "
        "scan_freq)"))

    def goes(self, own_dbm: float, other_dbm: float, channel: int) -> bool:
        """Whether another access point is enough better than the own one, on this ``channel``."""
        if self.better_db is not None:
            return other_dbm - own_dbm >= self.better_db
        own, other = round(own_dbm), round(other_dbm)
        noise = _NOISE_DBM[channel > 14]
        own_rate, other_rate = estimated_mbps(own - noise), estimated_mbps(other - noise)
        if other_rate > own_rate + _FASTER_MBPS:
            return True
        if own > other or own - noise > _GREAT_DB:
            return False
        gain_db = next((gain_db for below_dbm, gain_db in _GAIN_DB if own < below_dbm), _STRONG_DB)
        # A stronger signal never has a lower rate.
        gain_db -= next((less_db for more, less_db in _LESS_DB if other_rate > more * own_rate), 0)
        return other - own >= gain_db


def estimated_mbps(snr_db: int) -> float:
    """The rate that wpa_supplicant 2.10 expects at a signal above noise: of 802.11n in 20 MHz and
    802.11a, the higher one, whatever the network has (scan.c; as its log says from 2 to 39 dB)."""
    return float(np.interp(snr_db, _SNR_DB, _MBPS))
