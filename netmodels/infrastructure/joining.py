"""The frames by which a station gets to an access point, one after another.

Their sizes are those of hostapd and wpa_supplicant 2.10 on 802.11n, with header and check sequence.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

from pydantic import Field

from desim import ports
from desim.units import NS_PER_S, ByteSize, Duration, Period
from netmodels.hops import Hops, Report
from netmodels.radio.standards import CHANNELS_2GHZ, CHANNELS_5GHZ

_HEADERS_BYTES = 18  # a packet on the air is so much longer than with Ethernet's headers

# On the air, in turn from the station and from the access point.
_OPEN = (34, 34, 117, 137)  # authentication, association
_WPA2 = (34, 34, 139, 137)
_KEYS = (137, 159, 193, 137)  # from the access point: the 4-way handshake
_FAST = (168, 180, 259, 320)  # 802.11r: both and the keys at once
_ASSOCIATION = 2  # the number of its first frame in each of these

Security = Literal["open", "wpa2"]


class JoiningConstants(ports.Constants):
    """The times of beacons, scans and joining, and the sizes of frames that belong to no joining.
    """

    beacon_ns: Period = Field("102.4 ms", description=(
        "between an access point's beacons (hostapd: beacon_int 100)"))
    beacon_frame_bytes: ByteSize | None = Field("250 B", ge=28, description=(
        "of a beacon on the air (our estimate: 802.11n, WPA2 and WMM are announced; null: it takes "
        "no airtime, and is heard wherever the signal is found)"))

    tick_ns: Period = Field("4 ms", le=10**7, description=(
        "of the kernel's clock: waits of a scan end with one, and an association begins with one "
        "(Linux CONFIG_HZ=250)"))
    channels: tuple[int, ...] = Field((*CHANNELS_2GHZ, *CHANNELS_5GHZ), description=(
        "that a scan of all of them visits (cfg80211: world_regdom)"))
    asks_on: tuple[int, ...] = Field(tuple(range(1, 12)), description=(
        "channels on which a scan asks who is there; on others it waits for beacons (cfg80211: "
        "world_regdom)"))
    processing_ns: Duration = Field("1 ms", description=(
        "of one frame of joining, in its receiver (our estimate: hostapd and wpa_supplicant in "
        "User-Mode Linux by the wall clock took 0.7 to 4 ms)"))
    timeout_ns: Period = Field("200 ms", description=(
        "after which a lost frame is sent again (mac80211: IEEE80211_AUTH_TIMEOUT, "
        "IEEE80211_ASSOC_TIMEOUT)"))
    tries: int = Field(3, ge=1, description="of a frame (mac80211: IEEE80211_AUTH_MAX_TRIES)")
    again_ns: Period = Field("5 s", description=(
        "between scans of a station that is not associated (wpa_supplicant: scan_interval)"))
    lost_beacons: int = Field(7, ge=1, description=(
        "in a row, after which a station doubts that its access point is there (mac80211: "
        "beacon_loss_count)"))
    probe_wait_ns: Duration = Field("500 ms", description=(
        "until it gives up then (mac80211: probe_wait_ms)"))
    dtim: int = Field(2, ge=1, description="beacons from one with a DTIM to the next (hostapd: "
                                           "dtim_period)")
    awake_ns: Duration = Field("100 ms", description=(
        "after a station's last frame until it sleeps, with power_save (mac80211: "
        "dynamic_ps_timeout)"))
    sleep_frame_bytes: ByteSize = Field("28 B", ge=28, description=(
        "of a frame that says that a station sleeps or is back (802.11-2016: header and check "
        "sequence)"))

    def dwell_ns(self, channel: int) -> int:
        """The time of a scan on a channel: an active one waits before and behind its question for a
        33rd of a second, a passive one for a 9th (mac80211: IEEE80211_PROBE_DELAY,
        IEEE80211_CHANNEL_TIME, IEEE80211_PASSIVE_CHANNEL_TIME), each in whole ticks, until the
        tick behind."""
        return 2 * self._waits_ns(33) if channel in self.asks_on else self._waits_ns(9)

    @property
    def home_ns(self) -> int:
        """The time on the own channel between two visits of others (ieee80211_scan_state_suspend).
        """
        return self._waits_ns(5)

    def stays_away(self, away_ns: int, channel: int) -> bool:
        """Whether a station that has been away for so long visits another channel before it
        returns: an eighth of a second is the most (ieee80211_scan_state_decision)."""
        ticks = 2 * self._ticks(33) if channel in self.asks_on else self._ticks(9)
        return away_ns + ticks * self.tick_ns <= self._ticks(8) * self.tick_ns

    def _waits_ns(self, part: int) -> int:
        return (self._ticks(part) + 1) * self.tick_ns

    def _ticks(self, part: int) -> int:
        """The whole ticks of a part of a second."""
        ticks: int = NS_PER_S // self.tick_ns // part
        return ticks


def steps(security: Security, fast: bool) -> tuple[tuple[bool, int], ...]:
    """The frames of joining, in order: whether the station sends it, and its bytes on the air;
    ``fast`` by 802.11r, where there are keys."""
    turns = True, False, True, False
    if security == "open":
        return tuple(zip(turns, _OPEN, strict=True))
    if fast:
        return tuple(zip(turns, _FAST, strict=True))
    return (*zip(turns, _WPA2, strict=True),
            *zip((False, True, False, True), _KEYS, strict=True))


class ControlFrames:
    """Frames that stations send of themselves, by their bytes on the air; ``frames`` and ``bytes``
    count them."""

    def __init__(self, air: Hops) -> None:
        self.air = air
        self.frames = self.bytes = 0

    def send(self, source: int, receivers: tuple[int, ...], size_bytes: int, broadcast: bool,
             report: Report, dscp: int = 0) -> None:
        """Send one, past what waits for the radio."""
        self.frames, self.bytes = self.frames + 1, self.bytes + size_bytes
        self.air.send(source, receivers, size_bytes - _HEADERS_BYTES, 1, broadcast, report,
                      dscp=dscp)


class Handshake:
    """Frames between a station and an access point, each sent when the one before has been
    processed, the one that asks to be associated at the next tick (mac80211:
    ieee80211_mgd_assoc). ``done(came)`` is called when the last one has been, or one is given up.
    """

    def __init__(self, control: ControlFrames, station: int, access_point: int,
                 frames: Sequence[tuple[bool, int]], constants: JoiningConstants,
                 done: Callable[[bool], object]) -> None:
        self._control, self._air = control, control.air
        self._constants, self._done = constants, done
        self._ends = access_point, station
        self._frames, self._next, self._tries = frames, 0, 0
        self._over = False
        self._began_ns = self._air.now_ns  # with a tick, as scans end with one
        self._send(None)

    def cancel(self) -> None:
        """Send no more, and call nobody."""
        self._over = True

    def _send(self, _: None) -> None:
        if self._over:
            return
        from_station, size_bytes = self._frames[self._next]
        self._tries += 1
        self._control.send(self._ends[from_station], (self._ends[not from_station],), size_bytes,
                           False, self._settled)
        self._again_ns = self._air.now_ns + self._constants.timeout_ns

    def _settled(self, _: ports.Frame, __: Sequence[int], verdict: ports.Deliver | ports.Drop,
                 ___: dict[int, str]) -> None:
        now_ns = self._air.now_ns
        if isinstance(verdict, ports.Deliver):
            self._air.at(now_ns + self._constants.processing_ns, self._processed)
        elif self._tries < self._constants.tries:
            self._air.at(max(now_ns, self._again_ns), self._send)
        else:
            self._air.at(now_ns, self._end, False)

    def _processed(self, _: None) -> None:
        self._next, self._tries = self._next + 1, 0
        if self._next == _ASSOCIATION:
            tick_ns, now_ns = self._constants.tick_ns, self._air.now_ns
            self._air.at(now_ns + -(now_ns - self._began_ns) % tick_ns, self._send)
        elif self._next < len(self._frames):
            self._send(None)
        else:
            self._end(True)

    def _end(self, came: bool) -> None:
        if not self._over:
            self._over = True
            self._done(came)
