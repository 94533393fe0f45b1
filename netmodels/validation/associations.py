"""Association, roaming and power save against hostapd and wpa_supplicant over Linux's mac80211.

Linux 6.1.192 (User-Mode Linux in simulated time, 100 ticks a second, computing takes no time),
mac80211_hwsim, hostapd and wpa_supplicant 2.10. A program takes the place of the medium: signals
follow a path loss over the distance, and frames have the airtime of their rate. A station walks
past six access points (channels 36, 40, 44, 48, 36, 40, each 40 m from the last one) at 1 m/s, 5 m
beside them, with 50 datagrams a second each way. ``associations_on_linux.csv`` has its events.

Station and access points share a kernel there: hostapd's answer to a roaming station waits 20 ms
for a lock that the station's kernel holds. So gaps are those without it: a tick, and the time from
the request to be associated on.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from importlib.resources import files
from typing import NamedTuple

from desim import ports
from desim.ports.cases import NOWHERE, Check, Flow, Play, Setup
from desim.units import NS_PER_S
from netmodels.infrastructure import Infrastructure
from netmodels.radio.radio import Radio
from netmodels.validation.tolerance import within

_CHANNELS = 36, 40, 44, 48, 36, 40
_SCANNED = (*range(1, 12), 14, *_CHANNELS[:4], *range(149, 166, 4), *range(171, 186))  # hwsim's 36
KERNEL = {"tick": "10 ms", "processing": "0 ns", "channels": _SCANNED, "asks_on": _SCANNED}
_TICK_MS = 10.0
_MS = 1_000_000
_WALKS: dict[str, dict[str, object]] = {
    "known channels": {"roaming": {"scan": "known"}},
    "802.11r": {"roaming": {"scan": "known"}, "fast_transition": True},
    "eager": {"roaming": {"scan": "known", "often": "3 s", "threshold": "-70 dBm",
                          "seldom": "60 s"}},
    "all channels": {"roaming": {"scan": "all"}},
}
# From the begin of a scan to the last frame of joining, ms.
_JOINS: dict[tuple[str, str], float] = {
    ("open", "known"): 90.5, ("wpa2", "known"): 92.0, ("wpa2", "all"): 2892.0}
# A datagram to a station that sleeps: mean, and what 5 % exceed, ms; none of 240 and 100 is lost.
_SLEEPS = {False: (50.1, 96.9), True: (102.6, 191.5)}  # True: broadcasts, each second beacon a DTIM
_OUTSIDE = {("all channels", "ap_3")}  # levels 1 dB apart: Linux scans twice in a row, and is there
# 8.3 s earlier


class MeasuredHandover(NamedTuple):
    """A change of Linux's station: when it left, and the time without an access point, ms."""

    access_point: str
    leaves_s: float
    gap_ms: float


def on_linux(walk: str) -> list[MeasuredHandover]:
    """The handovers of a walk, in s since it began."""
    out = []
    with files(__package__).joinpath("associations_on_linux.csv").open(encoding="utf-8") as file:
        times: dict[str, float] = {}
        for row in csv.DictReader(file):
            if row["walk"] == walk:
                times[row["event"]] = float(row["time_s"])
                if row["event"] == "joined":
                    took_ms = 1000 * (times["joined"] - times["associates"])
                    out.append(MeasuredHandover(row["access_point"], times["leaves"],
                                                _TICK_MS + took_ms))
    return out


class AccessPointsOfLinux:
    """hostapd's and wpa_supplicant's: times of joining within 3 %; a walk past six access points:
    the same ones, left within 0.25 s (two beacons, and what a signal in whole dB leaves open), gaps
    within 5 %; what waits for a station that sleeps within 15 %, and nothing is lost."""

    source = "Linux 6.1.192, hostapd and wpa_supplicant 2.10 over mac80211_hwsim (virtual time)"

    def checks(self, play: Play) -> Iterator[Check]:
        for (security, scan), measured_ms in _JOINS.items():
            yield within(0.03, f"scan and joining, {security}, {scan} channels",
                         _joining_ms(play, security, scan), measured_ms, "ms")
        for walk, settings in _WALKS.items():
            yield from walked(play, walk, settings)
        for broadcast, (mean_ms, p95_ms) in _SLEEPS.items():
            found = play(Setup(_radio((36,), power_save=True), {"robot": (5.0, 0.0),
                                                               "base": NOWHERE},
                               [Flow("base", ("robot",), 146, 100, "periodic", 337 * _MS,
                                     broadcast=broadcast)], 120 * NS_PER_S))
            what = "asleep, broadcasts" if broadcast else "asleep"
            yield within(0.15, f"{what}: mean delay", found["delay_mean_ms"], mean_ms, "ms")
            yield within(0.15, f"{what}: 95 % within", found["delay_p95_ms"], p95_ms, "ms")
            yield Check(f"{what}: delivered", found["delivery_ratio"], 1.0, 0.01)


def walked(play: Play, walk: str, settings: dict[str, object]) -> Iterator[Check]:
    """A walk beside Linux's."""
    model = _radio(_CHANNELS, **settings)
    play(Setup(model, {"robot": (0.0, 5.0), "base": NOWHERE}, [], 230 * NS_PER_S,
               motion={"robot": ((200 * NS_PER_S, 200.0, 5.0),)}))
    measured = on_linux(walk)
    assert isinstance(model, ports.KnowsHandovers)
    own = _handovers(model)
    yield Check(f"walk, {walk}: handovers", len(own), len(measured), 0)
    for found, there in zip(own, measured, strict=False):
        if (walk, there.access_point) not in _OUTSIDE:
            leaves_s = found.leaves_s if found.access_point == there.access_point else float("nan")
            yield Check(f"walk, {walk}: to {there.access_point}", leaves_s, there.leaves_s, 0.25,
                        "s")
        yield within(0.05, f"walk, {walk}: gap to {there.access_point}", found.gap_ms,
                     there.gap_ms, "ms")


def _handovers(model: object) -> list[MeasuredHandover]:
    assert isinstance(model, Infrastructure)
    return [MeasuredHandover(one.access_point, (one.time_ns - one.gap_ns) / NS_PER_S,
                             one.gap_ns / _MS) for one in model.associations.handovers]


def _joining_ms(play: Play, security: str, scan: str) -> float:
    """The time from the begin of a run, with which a scan begins, until a station has joined."""
    model = _radio((36,), security=security, associated=False, roaming={"scan": scan})
    play(Setup(model, {"robot": (5.0, 0.0), "base": NOWHERE}, [], 5 * NS_PER_S))
    assert isinstance(model, Infrastructure)
    (joined,) = model.associations.handovers
    return (joined.time_ns - model.associations.scanned_ns(joined.host)) / _MS


def _radio(channels: tuple[int, ...], **infrastructure: object) -> ports.NetworkModel:
    """802.11a at 6 Mb/s as hwsim's management frames, the path loss of the program."""
    return Radio.build(Radio.Params.model_validate({
        "standard": "11a", "rate": "6 Mb/s",
        "path_loss": {"model": "log_distance", "exponent": 3, "reference": "46.6777 dB"},
        "access_points": [{"at": [f"{40 * k} m", "0 m"], "channel": channel}
                          for k, channel in enumerate(channels)],
        "infrastructure": {"wired": ["base"], "constants": KERNEL, **infrastructure}}))
