"""Minstrel-HT against Linux's own, step by step and over links with given losses.

Linux 6.1.192 (User-Mode Linux in simulated time, 100 ticks a second) with mac80211_hwsim, hostapd
and wpa_supplicant, 802.11n in 20 MHz with two streams. A program takes the place of the medium: it
loses each attempt with the chance of its rate, and reports it after its time. One saturated sender;
its frames go alone, as the program refuses block acknowledgements.
"""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Iterator
from importlib.resources import files
from typing import NamedTuple

from desim import ports
from desim.ports.cases import NOWHERE, Check, Flow, Play, Setup
from desim.units import NS_PER_S
from netmodels.ethernet import ETHERNET_BYTES
from netmodels.radio.high_throughput import high_throughput, with_fewer_streams
from netmodels.radio.minstrel.control import MinstrelHt, MinstrelPair
from netmodels.radio.minstrel.groups import rate_table
from netmodels.radio.standards import ACK_BYTES, Standard, psdu_bytes
from netmodels.validation.tolerance import within

TRIES = 11  # max_rate_tries of mac80211_hwsim
_PAYLOAD_BYTES = 1200
_SIZE_BYTES = _PAYLOAD_BYTES + ETHERNET_BYTES
_DURATION_NS = 30 * NS_PER_S


class Losses(NamedTuple):
    """Chances that an attempt arrives, by MCS, of one stream and of two."""

    one: tuple[float, ...]
    two: tuple[float, ...]


GOOD = Losses((1, 1, 1, 1, 1, .99, .97, .93), (1, 1, 1, .98, .95, .85, .6, .3))
MIDDLE = Losses((1, 1, 1, .98, .9, .5, .2, .05), (1, .97, .9, .6, .2, .05, 0, 0))
POOR = Losses((.95, .8, .5, .2, .05, 0, 0, 0), (.5, .2, .05, 0, 0, 0, 0, 0))
HALF = Losses(8 * (.5,), 8 * (.5,))


class LinuxLink(NamedTuple):
    """Linux's 30 s: the losses by the second from which they hold; goodput by the time of
    the attempts; the rates with at least a tenth of the attempts (MCS, from 8 on of two streams),
    and their share."""

    losses: dict[int, Losses]
    goodput_mbps: float
    rates: tuple[int, ...]
    share: float


LINKS = {
    "good": LinuxLink({0: GOOD}, 26.950, (13, 14), .951),
    "middle": LinuxLink({0: MIDDLE}, 17.430, (10, 4, 11, 5), .963),
    "poor": LinuxLink({0: POOR}, 7.021, (2, 1), .821),
    "half": LinuxLink({0: HALF}, 17.241, (15, 14, 13), .885),
    "good, from 10 to 20 s poor": LinuxLink({0: GOOD, 10: POOR, 20: GOOD}, 19.613, (13, 14), .777),
}
_CHAINS = "minstrel_ht_on_linux.csv"


class MinstrelOfLinux:
    """Minstrel-HT: the four rates of each frame and how often each is tried, from Linux's attempts,
    are Linux's. Over five links goodput within 3 %, and the share of the rates that Linux mostly
    used within 0.05."""

    source = "Linux 6.1.192, rc80211_minstrel_ht.c over mac80211_hwsim (virtual time)"

    def checks(self, play: Play) -> Iterator[Check]:
        standard = _standard()
        same, steps = same_chains(standard)
        yield Check(f"Linux's rates, {steps} steps: share that is the same", same / steps, 1.0, 0.0)
        for name, measured in LINKS.items():
            link = LossyLink(standard, measured.losses)
            found = play(Setup(link, {"a": NOWHERE, "b": NOWHERE}, [
                Flow("a", ("b",), _SIZE_BYTES, _PAYLOAD_BYTES)], _DURATION_NS))
            share = sum(link.counts[rate] for rate in measured.rates) / link.counts.total()
            rates = ", ".join(map(str, measured.rates))
            yield within(0.03, f"{name}: goodput", found["goodput_mbps"], measured.goodput_mbps,
                         "Mb/s")
            yield Check(f"{name}: share of MCS {rates}", share, measured.share, 0.05)


def _standard() -> Standard:
    shape = "11n", 20, 2, None
    return with_fewer_streams(high_throughput(*shape, 36), *shape)


def same_chains(standard: Standard) -> tuple[int, int]:
    """The number of Linux's steps that give the same rates here, and of all. Of each step the
    file has the time of its end, the frames in it, attempts and acknowledgements by rate, and the
    rates with their repeats that Linux had then (MCS, from 8 on of two streams)."""
    table, columns = rate_table(standard), [range(10)]  # these say what is tried next
    pairs: dict[str, MinstrelPair] = {}
    same = steps = 0
    with files(__package__).joinpath(_CHAINS).open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            pair = pairs.setdefault(row["run"], MinstrelPair(table, columns, TRIES))
            for counts in row["counts"].split():
                pair.known.attempt(*map(int, counts.split(":")))
            for _ in range(int(row["frames"]) - 1):
                pair.known.frame(1)
            pair.status(1, int(row["time_ms"]) * 10**6)
            chain = [tuple(map(int, stage.split(":"))) for stage in row["chain"].split()]
            same += chain == pair.stages
            steps += 1
    return same, steps


class LossyLink:
    """A network: the medium that Linux had. An attempt takes as long as without contention, and is
    lost by the chance of its rate then (``losses`` by the second from which they hold).
    ``counts``: attempts by rate."""

    class Params(ports.Params):
        """None."""

    reasons = ("retry_limit",)

    def __init__(self, standard: Standard, losses: dict[int, Losses]) -> None:
        self._standard, self._losses = standard, losses
        self.counts = Counter[int]()
        self._free_ns = 0

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context, self._draws = context, context.stream("losses")
        self._learner = MinstrelHt(self._standard, TRIES, context.stream("minstrel_ht"))
        self._rate = self._learner.first

    def send(self, frame: ports.Frame) -> None:
        """Send a frame behind those before, until it arrives or has had its tries."""
        context, tries = self._context, 0
        self._free_ns = max(self._free_ns, context.now_ns)
        while True:
            rate = self._standard.rates[self._rate]
            assert rate.mcs is not None
            now_s = self._free_ns / NS_PER_S
            losses = self._losses[max(since for since in self._losses if since <= now_s)]
            self.counts[rate.mcs + 8 * (rate.streams - 1)] += 1
            tries += 1
            self._free_ns += _attempt_ns(self._standard, self._rate)
            arrives = self._draws.random() < losses[rate.streams - 1][rate.mcs]
            self._rate = self._learner.sent(0, 1, 1, arrives, self._free_ns).rate
            if arrives or tries == TRIES:
                break
        if arrives:
            context.settle(frame, frame.receivers[0], ports.Deliver(self._free_ns - context.now_ns))
        else:
            context.at(self._free_ns, self._give_up, frame)

    def _give_up(self, frame: ports.Frame) -> None:
        self._context.settle(frame, frame.receivers[0], ports.Drop("retry_limit"))


def _attempt_ns(standard: Standard, rate: int) -> int:
    """AIFS of 34 us as the program had it, half of the least window, the frame, and its
    acknowledgement at 24 Mb/s."""
    return (34_000 + standard.cw_min * standard.slot_ns // 2 + standard.airtime_ns(
        psdu_bytes(_SIZE_BYTES, 1) + standard.qos_bytes, rate) + standard.sifs_ns
        + standard.airtime_ns(ACK_BYTES, standard.rate(24)))
