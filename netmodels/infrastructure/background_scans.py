"""The times of a station's background scans."""

from __future__ import annotations

from desim.units import NS_PER_S
from netmodels.infrastructure.roaming import Roaming

_UNITS = 16  # of a dB, in which mac80211 keeps the mean of the signal (ewma_beacon_signal)
_BEACONS = 4  # that are heard before it counts (IEEE80211_SIGNAL_AVE_MIN_COUNT)
_HYSTERESIS_DB = 4  # bgscan_simple.c, wpa_drv_signal_monitor
_SETTLING_NS = NS_PER_S  # since the last scan, before a signal that gets weak brings a new one
_AGAIN_NS = 10 * NS_PER_S  # ... and before one that gets weaker does


class BackgroundScans:
    """Says when a station that is associated scans, by wpa_supplicant 2.10 (bgscan_simple.c): at
    two intervals, and at once when the mean of its signal falls below the threshold, or by more
    than 4 dB since that was last noticed (mac80211: ieee80211_handle_beacon_sig). After as many
    scans at the short interval as the long one has room for, and one more, the long one holds."""

    def __init__(self, roaming: Roaming) -> None:
        self._roaming = roaming
        often_ns, seldom_ns = roaming.often_ns, roaming.seldom_ns
        # Scans at the short interval in a row; without a long one there is no end.
        self._most = seldom_ns // often_ns + 1 if often_ns and seldom_ns else 0
        self.begin(0, True)

    def begin(self, now_ns: int, weak: bool) -> None:
        """The station has just been associated, ``weak`` if the signal is below the threshold."""
        self._beacons = self._mean = 0
        self._noted_dbm: int | None = None
        self._weak, self._scanned_ns, self._short = weak, now_ns, 0
        self._due_ns = self._next_ns(now_ns)

    def hear(self, now_ns: int, power_dbm: float) -> None:
        """A beacon of the own access point comes with this power."""
        lost = _UNITS * -round(power_dbm)
        self._mean = (3 * self._mean + lost) // 4 if self._beacons else lost  # always rounded down
        self._beacons += 1
        if self._beacons >= _BEACONS:
            self._compare(now_ns, -(self._mean // _UNITS))

    def begins(self, now_ns: int) -> bool:
        """Whether it is time for a scan, which begins."""
        if self._due_ns is None or now_ns < self._due_ns:
            return False
        self._scanned_ns = now_ns
        self._short = max(self._short + (1 if self._weak else -1), 0)
        if self._weak and self._most and self._short >= self._most:
            self._weak, self._short = False, 0
        self._due_ns = self._next_ns(now_ns)
        return True

    def _next_ns(self, now_ns: int) -> int | None:
        every_ns = self._roaming.often_ns if self._weak else self._roaming.seldom_ns
        return None if every_ns is None else now_ns + every_ns

    def _compare(self, now_ns: int, signal_dbm: int) -> None:
        """See whether the signal has changed by enough, and whether a scan is due for it."""
        noted_dbm, threshold_dbm = self._noted_dbm, self._roaming.threshold_dbm
        low = signal_dbm < threshold_dbm and (
            noted_dbm is None or signal_dbm < noted_dbm - _HYSTERESIS_DB)
        high = signal_dbm > threshold_dbm and (
            noted_dbm is None or signal_dbm > noted_dbm + _HYSTERESIS_DB)
        if not low and not high:
            return
        self._noted_dbm = signal_dbm
        since_ns = now_ns - self._scanned_ns
        if high:
            if self._weak:
                self._weak = False
                self._due_ns = self._next_ns(now_ns)
        elif not self._weak:
            self._weak = True
            if self._roaming.often_ns is None:
                self._due_ns = None
            elif since_ns > _SETTLING_NS:
                self._due_ns = now_ns
            else:
                self._due_ns = self._next_ns(now_ns)
        elif self._roaming.often_ns is not None and since_ns > _AGAIN_NS:
            self._due_ns = now_ns
