"""The frames by which a station gets to an access point, one after another.

Their sizes are those of their parts (IEEE 802.11-2016, 9.3.3 and 12.7.2): 24 B of header and 4 B of
check sequence, a name of the network of 8 B, 8 + 4 rates, RSN of 20 B (with a PMKID 38 B), the
mobility domain's 3 B, a fast transition element of 96 B, for the last but one of these frames with
the group's key; EAPOL-Key: 8 B of LLC, 4 B and 95 B of headers, key data of 22, 22, 56 and 0 B.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

from pydantic import Field

from desim import ports
from desim.units import ByteSize, Duration, Period
from netmodels.hops import Hops, Report

_HEADERS_BYTES = 18  # a packet on the air is so much longer than with Ethernet's headers

# On the air, in turn from the station and from the access point.
_OPEN = (34, 34, 80, 50)  # authentication, association
_KEYS = (157, 157, 191, 135)  # from the access point: the 4-way handshake
_FAST = (177, 185, 215, 238)  # 802.11r: both and the keys at once

Security = Literal["open", "wpa2"]


class JoiningConstants(ports.Constants):
    """The times of beacons, scans and joining, and the sizes of frames that belong to no joining.
    """

    beacon_ns: Period = Field("102.4 ms", description=(
        "between an access point's beacons (hostapd: beacon_int 100)"))
    beacon_frame_bytes: ByteSize | None = Field("250 B", ge=28, description=(
        "of a beacon on the air (our estimate: 802.11n, WPA2 and WMM are announced; null: it takes "
        "no airtime, and is heard wherever the signal is found)"))

    dwell_ns: Duration = Field("140 ms", description=(
        "of a scan on one channel (measured: mac80211_hwsim with wpa_supplicant, one channel "
        "0.14 s, all of them 4.22 s)"))
    home_ns: Duration = Field("200 ms", description=(
        "between two channels of a scan, on the own one, where a station is associated (mac80211: "
        "ieee80211_scan_state_suspend)"))
    channels: int = Field(30, ge=1, description=(
        "that a scan of all of them visits (4.22 s: see dwell)"))
    processing_ns: Duration = Field("2.5 ms", description=(
        "of one frame of joining, in its receiver (measured with hostapd: open authentication and "
        "association, four frames, 10 ms)"))
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


def steps(security: Security, fast: bool) -> tuple[tuple[bool, int], ...]:
    """The frames of joining, in order: whether the station sends it, and its bytes on the air;
    ``fast`` by 802.11r, where there are keys."""
    turns = True, False, True, False
    if security == "wpa2" and fast:
        return tuple(zip(turns, _FAST, strict=True))
    keys = zip((False, True, False, True), _KEYS, strict=True) if security == "wpa2" else ()
    return (*zip(turns, _OPEN, strict=True), *keys)


class ControlFrames:
    """Frames that stations send of themselves, by their bytes on the air; ``frames`` and ``bytes``
    count them."""

    def __init__(self, air: Hops) -> None:
        self.air = air
        self.frames = self.bytes = 0

    def send(self, source: int, receivers: tuple[int, ...], size_bytes: int, broadcast: bool,
             report: Report) -> None:
        """Send one, past what waits for the radio."""
        self.frames, self.bytes = self.frames + 1, self.bytes + size_bytes
        self.air.send(source, receivers, size_bytes - _HEADERS_BYTES, 1, broadcast, report)


class Handshake:
    """Frames between a station and an access point, each sent when the one before has been
    processed. ``done(came)`` is called when the last one has been, or one is given up."""

    def __init__(self, control: ControlFrames, station: int, access_point: int,
                 frames: Sequence[tuple[bool, int]], constants: JoiningConstants,
                 done: Callable[[bool], object]) -> None:
        self._control, self._air = control, control.air
        self._constants, self._done = constants, done
        self._ends = access_point, station
        self._frames, self._next, self._tries = frames, 0, 0
        self._over = False
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
        if self._next < len(self._frames):
            self._send(None)
        else:
            self._end(True)

    def _end(self, came: bool) -> None:
        if not self._over:
            self._over = True
            self._done(came)
