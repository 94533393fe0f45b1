"""AARF and the best rate by the signal as ns-3 has them: stations that stand, move, and contend."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from desim.ports.cases import NOWHERE, Check, Flow, Play, Setup
from desim.units import NS_PER_S
from netmodels.cases.traffic import SAME_POWER, numbered
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.validation.tolerance import within

Ways = dict[str, list[tuple[int, float, float]]]

_NAMES = "sender", "station", "robot"  # of hosts, whose backoffs have streams by name


class Rates(NamedTuple):
    """A rate control on stations of a standard."""

    model: str
    standard: str
    mhz: int = 20
    streams: int = 1

    def __str__(self) -> str:
        return (f"{self.model}, {self.standard}, {self.mhz} MHz"
                + (f", {self.streams} streams" if self.streams > 1 else ""))


AARF, IDEAL = Rates("aarf_ns3", "11a"), Rates("ideal", "11a")
IDEAL_HT, IDEAL_HT_2 = Rates("ideal", "11n"), Rates("ideal", "11n", streams=2)
IDEAL_VHT, IDEAL_HE = Rates("ideal", "11ac", 80), Rates("ideal", "11ax")

# Mb/s of payload, packets of 1000 B of UDP, saturated: by m from the sink; by the ends of a way and
# the seconds from one to the other, there and back so often; and by stations, every pair at
# -50 dBm. Means of one to five seeds, of 10 to 30 s, of moving pairs the whole way.
STANDING = {
    AARF: {20: 24.556, 24: 20.955, 33: 19.366, 42: 15.085},
    IDEAL_HT: {20: 52.628, 24: 35.069, 42: 23.340},
    IDEAL_HT_2: {10: 115.438, 20: 104.441, 33: 70.094},
    IDEAL_VHT: {10: 245.631, 16: 153.501, 24: 104.552},
    IDEAL_HE: {10: 102.074, 20: 69.357, 33: 46.238},
    IDEAL: {20: 24.546, 24: 19.712, 33: 19.673, 42: 15.299},
}
MOVING = {
    AARF: {(5, 45, 40, 1): 20.699, (10, 42, 16, 2): 20.630},
    IDEAL: {(5, 45, 40, 1): 20.622},
    IDEAL_HT: {(5, 45, 40, 1): 41.788},
    IDEAL_HE: {(5, 45, 40, 1): 62.255},
}
CONTENDING = {
    AARF: {2: 24.758, 3: 15.434, 5: 5.344, 10: 4.251},
    IDEAL: {2: 25.184, 10: 23.300},
    IDEAL_HT: {2: 54.860, 10: 41.469},
}


class RatesOfNs3:
    """AARF and the best rate by the signal, as ns-3 has them, saturated: goodput within 10 %."""

    source = "ns-3.44, AarfWifiManager, IdealWifiManager, AdhocWifiMac, one to five seeds"

    all = tuple(STANDING)

    def checks(self, play: Play) -> Iterator[Check]:
        for rates in self.all:
            yield from self._of(rates, play)

    @staticmethod
    def _of(rates: Rates, play: Play) -> Iterator[Check]:
        for stations, goodput_mbps in CONTENDING.get(rates, {}).items():
            found = float(np.mean([_mbps(
                play, rates, dict.fromkeys(numbered(name, stations), NOWHERE), 10,
                path_loss=SAME_POWER) for name in _NAMES]))
            yield within(0.1, f"{rates}, {stations} stations: goodput", found, goodput_mbps, "Mb/s")
        for far_m, goodput_mbps in STANDING[rates].items():
            found = _mbps(play, rates, {"sender": (far_m, 0)}, 5)
            yield within(0.1, f"{rates}, {far_m} m: goodput", found, goodput_mbps, "Mb/s")
        for (near_m, far_m, leg_s, turns), goodput_mbps in MOVING.get(rates, {}).items():
            found = _mbps(play, rates, {"sender": (near_m, 0)}, 2 * turns * leg_s,
                          {"sender": there_and_back(near_m, far_m, leg_s, turns)})
            yield within(0.1, f"{rates}, from {near_m} to {far_m} m in {leg_s} s and back: goodput",
                         found, goodput_mbps, "Mb/s")


def there_and_back(near_m: float, far_m: float, leg_s: int, turns: int
                   ) -> list[tuple[int, float, float]]:
    """Times in ns and places of one who begins to go after a second."""
    ends = [(near_m, far_m)[k % 2] for k in range(2 * turns + 1)]
    return [((1 + k * leg_s) * NS_PER_S, float(x_m), 0.0) for k, x_m in enumerate(ends)]


def _mbps(play: Play, rates: Rates, places: dict[str, tuple[float, float]], seconds: int,
          motion: Ways | None = None, **params: object) -> float:
    """From one second on, when the first rates are known."""
    if rates.standard == "11a":
        params |= {"rate": "6 Mb/s"}
    else:
        params |= {"channel": 36, "width": f"{rates.mhz} MHz", "streams": rates.streams}
    radio = DcfRadio(DcfRadio.Params(
        preset="ns3_3_44", standard=rates.standard, update="10 ms",
        rate_control={"model": rates.model}, **params))
    sink = NOWHERE if "path_loss" in params else (0.0, 0.0)
    flows = [Flow(sender, ("sink",), 1046, 1000, backlog=0 if rates.standard == "11a" else 128)
             for sender in places]
    return play(Setup(radio, places | {"sink": sink}, flows, (1 + seconds) * NS_PER_S, NS_PER_S,
                      motion=motion or {}))["goodput_mbps"]
