"""Roaming: when a station looks for another access point, and when it goes there."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from desim import ports
from desim.units import Decibels, Level, Period

# The least gain of a change by the present signal: below the level, dB (wpa_supplicant 2.7,
# events.c, wpa_supplicant_need_to_roam; its estimates of throughput are left out).
_GAIN_DB = ((-85.0, 1.0), (-80.0, 2.0), (-75.0, 3.0), (-70.0, 4.0))
_STRONG_DB = 5.0


class Roaming(ports.Params):
    """Background scans as wpa_supplicant's ``bgscan simple`` has them: often while the signal is
    weak, at once when it gets weak, and seldom while it is strong."""

    threshold_dbm: Level = Field("-65 dBm", description=(
        "of the own access point, below which a signal is weak (NetworkManager: simple:30:-65:300)"
        ))
    often_ns: Period | None = Field("30 s", description=(
        "between scans while the signal is weak (NetworkManager; null: no scans)"))
    seldom_ns: Period | None = Field("300 s", description=(
        "between scans while it is strong (NetworkManager; null: no scans)"))
    better_db: Decibels | None = Field(None, description=(
        "by which another one has to be stronger (wpa_supplicant: 1 dB below -85 dBm, then 2, 3 "
        "and 4 dB, 5 dB from -70 dBm on)"))
    scan: Literal["all", "known"] = Field("all", description=(
        "channels that a scan visits, all or those of the access points (wpa_supplicant without "
        "scan_freq)"))

    def goes(self, own_dbm: float, other_dbm: float) -> bool:
        """Whether another access point is enough stronger."""
        return other_dbm - own_dbm >= self._gain_db(own_dbm)

    def _gain_db(self, own_dbm: float) -> float:
        if self.better_db is not None:
            return self.better_db
        return next((gain_db for below_dbm, gain_db in _GAIN_DB if own_dbm < below_dbm),
                    _STRONG_DB)
