"""Stations that all hear each other: saturated, and with heartbeats, against ns-3."""

from __future__ import annotations

from collections.abc import Iterator

from desim.ports.cases import Check, Play
from netmodels.cases.broadcast import HeartbeatBroadcast
from netmodels.cases.saturation import Saturation
from netmodels.validation.tolerance import within

# Stations that all hear each other equally well, by standard, rate in Mb/s and slot: stations to
# Mb/s of payload (1000 B of UDP, one sink) and failed transmissions to all of them.
SATURATION = {
    ("11a", 6, None): {1: (4.984, .0000), 2: (4.770, .1119), 5: (4.405, .2587), 10: (4.089, .3647),
                       30: (3.522, .5217)},
    ("11a", 24, None): {1: (15.345, .0000), 2: (15.220, .1108), 5: (14.461, .2580),
                        10: (13.565, .3651), 30: (11.875, .5219)},
    ("11g", 54, None): {1: (18.618, .0000), 2: (20.242, .1135), 5: (20.723, .2583),
                        10: (20.011, .3665), 30: (18.116, .5186)},
    ("11g", 54, "9 us"): {1: (24.583, .0000), 2: (25.219, .1109), 5: (24.685, .2565),
                          10: (23.479, .3657), 30: (20.928, .5198)},
}


class SaturationOfOfdm:
    """802.11a and g saturated, as in ns-3: goodput within 1.5 %, failures within 0.015."""

    source = "ns-3.44, AdhocWifiMac, every pair at -50 dBm"

    def checks(self, play: Play) -> Iterator[Check]:
        for (standard, mbps, slot), rows in SATURATION.items():
            for stations, (goodput_mbps, failure_rate) in rows.items():
                found = play(Saturation(Saturation.Params(
                    standard=standard, rate=f"{mbps} Mb/s", stations=stations, slot=slot)).setup())
                slots = f"slot {slot}, " if slot else ""
                what = f"{standard}, {mbps} Mb/s, {slots}{stations} stations"
                yield within(0.015, f"{what}: goodput", found["goodput_mbps"], goodput_mbps, "Mb/s")
                yield Check(f"{what}: failures", found["failure_rate"], failure_rate, 0.015)


# Bianchi's model as ns-3 evaluates it: Mb/s of payload, 1500 B, by rate in Mb/s and stations.
SATURATION_11B = {
    11: {5: 6.4734, 10: 6.1774, 20: 5.7819, 30: 5.5289, 50: 5.1745},
    5.5: {5: 3.8896, 10: 3.6707, 30: 3.2429, 50: 3.0184},
    2: {5: 1.6228, 10: 1.5168, 30: 1.3253, 50: 1.2279},
    1: {5: .8437, 10: .7861, 30: .6847, 50: .6336},
}


class SaturationOf11b:
    """802.11b saturated, as in Bianchi's model: goodput within 2 %. Its figures are those of
    acknowledgements at 2 Mb/s (1 Mb/s at 1 Mb/s): by the formula 6.521 Mb/s for 5 stations at 11
    Mb/s, and 6.328 or 6.687 with acknowledgements at 1 or 11 Mb/s."""

    source = "ns-3, src/wifi/examples/reference/bianchi_11b_difs.txt"

    def checks(self, play: Play) -> Iterator[Check]:
        for mbps, rows in SATURATION_11B.items():
            for stations, goodput_mbps in rows.items():
                found = play(Saturation(Saturation.Params(
                    standard="11b", rate=f"{mbps} Mb/s", stations=stations,
                    payload="1500 B", basic_rates=["1 Mb/s", "2 Mb/s"])).setup())
                yield within(0.02, f"11b, {mbps} Mb/s, {stations} stations: goodput",
                             found["goodput_mbps"], goodput_mbps, "Mb/s")


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
