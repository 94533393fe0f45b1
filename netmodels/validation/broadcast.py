"""Heartbeats that stations broadcast, against ns-3."""

from __future__ import annotations

from collections.abc import Iterator

from desim.ports.cases import Check, Play
from netmodels.cases.broadcast import HeartbeatBroadcast

# Stations, Hz, Mb/s: share of copies received, at random times; 200 B of UDP.
POISSON = {(30, 50, 6): .9312, (10, 50, 6): .9905, (5, 50, 6): .9984, (2, 50, 6): .9987,
           (30, 10, 6): .9963, (10, 10, 6): .9993, (5, 10, 6): 1.0000, (2, 10, 6): 1.0000,
           (30, 50, 24): .9813, (10, 50, 24): .9934}

# Stations, Hz: from random phases, mean of several runs.
PERIODIC = {(10, 10): 1.0000, (30, 10): 1.0000, (10, 50): .9941, (30, 50): .9649}

# Stations, Hz: at random times, in a disc of 20 m radius.
DISC = {(5, 50): .9995, (10, 50): .9947, (30, 10): .9971, (30, 50): .9550}

_SEEDS = range(1, 6)


class Heartbeats:
    """Heartbeats that radios broadcast, as in ns-3: delivery within 0.01, and within 0.03 where
    places matter."""

    source = "ns-3.44, 802.11a, 200 B of UDP"

    def checks(self, play: Play) -> Iterator[Check]:
        for (stations, hz, mbps), share in POISSON.items():
            yield Check(f"broadcast, {stations} stations, {hz} Hz, {mbps} Mb/s", _delivered(
                play, stations, hz, rate=f"{mbps} Mb/s"), share, 0.01)
        for (stations, hz), share in PERIODIC.items():
            runs = [_delivered(play, stations, hz, seed, arrivals="periodic", duration="2 s")
                    for seed in _SEEDS]
            yield Check(f"broadcast, {stations} stations, {hz} Hz, random phases",
                        sum(runs) / len(runs), share, 0.01)
        for (stations, hz), share in DISC.items():
            yield Check(f"broadcast, {stations} stations, {hz} Hz, disc of 20 m", _delivered(
                play, stations, hz, radius="20 m"), share, 0.03)
        for stations in (2, 30):
            yield Check(f"broadcast, {stations} stations, 10 Hz, same instant", _delivered(
                play, stations, 10, arrivals="zero", duration="5 s"), 0.0, 0.0)


def _delivered(play: Play, stations: int, hz: int, seed: int = 1, duration: str = "20 s",
               **params: str) -> float:
    case = HeartbeatBroadcast(HeartbeatBroadcast.Params(
        stations=stations, hz=f"{hz} Hz", duration=duration, **params))
    return play(case.setup(), seed)["delivery_ratio"]
