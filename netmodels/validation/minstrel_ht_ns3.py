"""Minstrel-HT as ns-3 has it, against ns-3: stations that contend, stand, and move."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from pydantic import PrivateAttr

from desim.ports.cases import NOWHERE, Check, Flow, Play, Setup
from desim.units import NS_PER_S
from netmodels.cases.traffic import SAME_POWER, numbered
from netmodels.radio.best_rate import RatioOf
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.learner import Choice, Learner
from netmodels.radio.rate_control import RateControl
from netmodels.radio.standards import Standard
from netmodels.validation.rates_of_ns3 import there_and_back
from netmodels.validation.tolerance import within

_FAST = 5  # the least MCS that counts as fast
_NAMES = "sender", "station", "robot"  # of hosts, whose backoffs have streams by name


class Row(NamedTuple):
    """Mb/s of payload and the share of packets at MCS 5 and above. Means of so many runs: four,
    moving five, standing two."""

    goodput_mbps: float
    fast: float


# 802.11n, one stream, 20 MHz, packets of 1000 B of UDP, by stations, every pair at -50 dBm; by m
# from the sink; and by the ends of a way and the seconds from one to the other, there and back
# twice, the first one once.
CONTENDING = {2: Row(53.574, .992), 3: Row(47.902, .980), 5: Row(41.760, .954),
              7: Row(36.999, .931), 10: Row(31.522, .875)}
STANDING = {24: Row(45.877, .997), 33: Row(34.565, .014), 42: Row(22.921, .025)}
MOVING = {(5, 45, 40, 1): Row(37.579, .658), (10, 42, 16, 2): Row(35.469, .580)}


class MinstrelOfNs3:
    """Minstrel-HT as ns-3 has it, saturated, means of three runs: goodput within 10 %, the share of
    fast rates within 0.05."""

    source = "ns-3.44, MinstrelHtWifiManager, AdhocWifiMac, two to five seeds"

    def checks(self, play: Play) -> Iterator[Check]:
        for far_m, row in STANDING.items():
            yield from _compared(f"{far_m} m", row, [_played(play, {"sender": (far_m, 0)}, 20)])
        for stations, row in CONTENDING.items():
            yield from _compared(f"{stations} stations", row, [_played(
                play, dict.fromkeys(numbered(name, stations), NOWHERE), 20, path_loss=SAME_POWER)
                for name in _NAMES])
        for (near_m, far_m, leg_s, turns), row in MOVING.items():
            way = there_and_back(near_m, far_m, leg_s, turns)
            yield from _compared(f"from {near_m} to {far_m} m in {leg_s} s and back", row, [_played(
                play, {name: (near_m, 0)}, 2 * turns * leg_s, {name: way}) for name in _NAMES])


def _compared(what: str, row: Row, played: list[Row]) -> Iterator[Check]:
    goodput_mbps, fast = np.mean(played, axis=0).tolist()
    yield within(0.1, f"{what}: goodput", goodput_mbps, row.goodput_mbps, "Mb/s")
    yield Check(f"{what}: share of MCS 5 to 7", fast, row.fast, 0.05)


def _played(play: Play, places: dict[str, tuple[float, float]], seconds: int,
            motion: dict[str, list[tuple[int, float, float]]] | None = None, **params: object
            ) -> Row:
    """From one second on, when the first rates are known."""
    watched = WatchedControl(model="minstrel_ht_ns3")
    radio = DcfRadio(DcfRadio.Params(preset="ns3_3_44", standard="11n", channel=36, update="10 ms",
                                     rate_control=watched, **params))
    sink = NOWHERE if params else (0.0, 0.0)
    found = play(Setup(radio, places | {"sink": sink}, [
        Flow(sender, ("sink",), 1046, 1000, backlog=128) for sender in places],
        (1 + seconds) * NS_PER_S, NS_PER_S, motion=motion or {}))
    rates = radio.standard.rates
    fast = sum(count for rate, count in watched.packets.items() if (rates[rate].mcs or 0) >= _FAST)
    return Row(found["goodput_mbps"], fast / watched.packets.total())


class WatchedControl(RateControl):
    """A rate control that counts the ``packets`` sent at each rate."""

    _packets: Counter[int] = PrivateAttr(default_factory=Counter)

    @property
    def packets(self) -> Counter[int]:
        return self._packets

    def of(self, standard: Standard, first: int, tries: int,
           stream: Callable[[str], np.random.Generator], ratio: RatioOf) -> Learner:
        return WatchedLearner(super().of(standard, first, tries, stream, ratio), self._packets)


class WatchedLearner:
    """``learner``, whose rates are counted."""

    def __init__(self, learner: Learner, packets: Counter[int]) -> None:
        self._learner, self._packets, self.first = learner, packets, learner.first
        self._rates: dict[tuple[int, int], int] = {}

    def sent(self, sender: int, receiver: int, packets: int, acknowledged: int, now_ns: int
             ) -> Choice:
        """``Learner.sent``."""
        pair = sender, receiver
        self._packets[self._rates.get(pair, self.first)] += packets
        choice = self._learner.sent(sender, receiver, packets, acknowledged, now_ns)
        self._rates[pair] = choice.rate
        return choice
