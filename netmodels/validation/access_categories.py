"""Stations of several access categories on one air, against ns-3."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from desim.ports.cases import NOWHERE, Arrivals, Check, Flow, Play, Setup
from desim.units import NS_PER_S
from netmodels.cases.traffic import SAME_POWER, udp_bytes
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.dcf.stations import Aggregation

# The marks of categories: CS1, none, AF41, CS6.
MARKS = {"background": 8, "best_effort": 0, "video": 34, "voice": 48}
RADIOS: dict[str, dict[str, object]] = {
    "11n": {"standard": "11n", "mcs": 4, "channel": 36, "aggregation": False},
    "11n, aggregates": {"standard": "11n", "mcs": 4, "channel": 36},
    "11a": {"standard": "11a", "rate": "24 Mb/s", "qos": True},
}
Measured = tuple[float, float]  # the mean of ns-3's runs, and its 95 % interval (0: of few runs)


class Saturated(NamedTuple):
    """Stations that are saturated in one category each, by category, or in all four; Mb/s of 1000 B
    of UDP that some and all categories carry, and the share of transmissions of data without a
    reply."""

    radio: str
    stations: dict[str, int]
    goodput_mbps: dict[str, Measured]
    failures: float

    def senders(self) -> dict[str, tuple[str, ...]]:
        """The categories of each sender."""
        kinds = [tuple(MARKS) if category == "all four" else (category,)
                 for category, count in self.stations.items() for _ in range(count)]
        return {f"sender_{number}": kind for number, kind in enumerate(kinds)}


class Quiet(NamedTuple):
    """A station with 200 B of voice every 20 ms beside saturated ones of best effort: the mean and
    the 95th percentile of its delay, ms."""

    radio: str
    stations: int
    arrivals: Arrivals
    mean_ms: Measured
    p95_ms: Measured


# Two to four runs of 10 s, of ``QUIET`` four and five of 20 s. Where two stations of voice and five
# of best effort aggregate, voice carries 11.763 +- 0.460 Mb/s in ns-3, and here 11.2, 5 % less.
SATURATED = (
    Saturated("11n", {"best_effort": 1, "voice": 1},
              {"voice": (23.133, 0.120), "all": (23.304, 0.052)}, 0.0135),
    Saturated("11a", {"best_effort": 1, "voice": 1},
              {"voice": (16.584, 0.112), "all": (16.754, 0.049)}, 0.0182),
    Saturated("11n, aggregates", {"best_effort": 1, "voice": 1},
              {"voice": (20.634, 0.980), "all": (22.822, 0.201)}, 0.0148),
    Saturated("11n", {"best_effort": 5, "voice": 2},
              {"voice": (20.460, 0.104), "all": (21.770, 0.061)}, 0.1577),
    Saturated("11a", {"best_effort": 5, "voice": 2},
              {"voice": (14.078, 0.171), "all": (15.308, 0.083)}, 0.1995),
    Saturated("11n, aggregates", {"best_effort": 5, "voice": 2},
              {"all": (21.595, 0.464)}, 0.1603),
    Saturated("11n", {"best_effort": 5, "voice": 5},
              {"voice": (20.307, 0.054), "all": (20.396, 0.021)}, 0.2966),
    Saturated("11a", {"best_effort": 5, "voice": 5},
              {"voice": (13.894, 0.067), "all": (13.963, 0.049)}, 0.3618),
    Saturated("11n, aggregates", {"best_effort": 5, "voice": 5},
              {"voice": (19.318, 0.427), "all": (19.842, 0.271)}, 0.2986),
    Saturated("11n", {"background": 5},
              {"all": (17.412, 0.000)}, 0.2631),
    Saturated("11a", {"background": 5},
              {"all": (13.180, 0.000)}, 0.2686),
    Saturated("11n", {"best_effort": 5},
              {"all": (19.145, 0.000)}, 0.2644),
    Saturated("11a", {"best_effort": 5},
              {"all": (14.182, 0.000)}, 0.2676),
    Saturated("11n, aggregates", {"best_effort": 5},
              {"all": (28.672, 0.000)}, 0.2697),
    Saturated("11n", {"video": 5},
              {"all": (23.600, 0.000)}, 0.0832),
    Saturated("11a", {"video": 5},
              {"all": (16.572, 0.000)}, 0.1218),
    Saturated("11n, aggregates", {"video": 5},
              {"all": (31.964, 0.000)}, 0.1604),
    Saturated("11n", {"voice": 5},
              {"all": (20.512, 0.000)}, 0.2862),
    Saturated("11a", {"voice": 5},
              {"all": (14.066, 0.000)}, 0.3508),
    Saturated("11n", {"all four": 3}, {"voice": (12.560, 0.124),
              "video": (9.660, 0.124), "all": (22.238, 0.026)}, 0.1600),
    Saturated("11a", {"all four": 3}, {"voice": (9.202, 0.115),
              "video": (6.243, 0.116), "all": (15.469, 0.020)}, 0.2125),
    Saturated("11n", {"all four": 1}, {"voice": (15.386, 0.355),
              "video": (8.461, 0.327), "all": (23.875, 0.019)}, 0.0000),
    Saturated("11a", {"all four": 1}, {"voice": (11.553, 0.158),
              "video": (5.558, 0.208), "all": (17.148, 0.007)}, 0.0000),
)
QUIET = (
    Quiet("11n", 1, "poisson", (0.2677, 0.0049), (0.5541, 0.0243)),
    Quiet("11a", 1, "poisson", (0.3618, 0.0091), (0.7471, 0.0432)),
    Quiet("11n, aggregates", 1, "poisson", (3.2949, 0.1051), (8.0309, 0.6939)),
    Quiet("11n", 1, "periodic", (0.2674, 0.0054), (0.5464, 0.0239)),
    Quiet("11n", 5, "poisson", (0.4259, 0.0152), (1.0881, 0.0593)),
    Quiet("11a", 5, "poisson", (0.5830, 0.0084), (1.5372, 0.0632)),
    Quiet("11n, aggregates", 5, "poisson", (5.2604, 0.3301), (14.7406, 1.6186)),
    Quiet("11n", 5, "periodic", (0.4214, 0.0053), (1.0790, 0.0672)),
)

_WARM_UP_NS = NS_PER_S
_SATURATED_S, _QUIET_S = 20, 100


def radio(name: str) -> DcfRadio:
    """One of ``RADIOS``, whose stations all hear each other equally well."""
    return DcfRadio(DcfRadio.Params(preset="ns3_3_44", path_loss=SAME_POWER, **RADIOS[name]))


def saturated(name: str, senders: Mapping[str, tuple[str, ...]]) -> list[Flow]:
    """The flows of hosts that are saturated in these categories, to one receiver."""
    backlog = 2 * Aggregation().packets if name.endswith("aggregates") else 0
    return [Flow(host, ("sink",), udp_bytes(1000), 1000, backlog=backlog, dscp=MARKS[category])
            for host, own in senders.items() for category in own]


def _setup(name: str, flows: list[Flow], seconds: int) -> Setup:
    return Setup(radio(name), dict.fromkeys([*(flow.source for flow in flows), "sink"], NOWHERE),
                 flows, _WARM_UP_NS + seconds * NS_PER_S, _WARM_UP_NS)


class AccessCategories:
    """Voice, video, best effort and background on one air, as in ns-3: goodput within 3 % or ns-3's
    interval, failures within 0.02, delays within 5 % or the interval."""

    source = ("ns-3.44, AdhocWifiMac with QoS, TXOP limits of Linux (voice: 1.504 ms), every pair "
              "at -50 dBm")

    def checks(self, play: Play) -> Iterator[Check]:
        for row in SATURATED:
            found = play(_setup(row.radio, saturated(row.radio, row.senders()), _SATURATED_S))
            what = f"{row.radio}, " + " and ".join(
                f"{count} {category}" for category, count in row.stations.items())
            for category, mbps in row.goodput_mbps.items():
                yield _within(0.03, f"{what}: goodput of {category}",
                              _goodput(found["goodput_mbps_by_mark"], category),
                              mbps, "Mb/s")
            yield Check(f"{what}: failures", found["failure_rate"], row.failures, 0.02)
        for quiet in QUIET:
            flows = saturated(quiet.radio, {f"sender_{k}": ("best_effort",)
                                          for k in range(quiet.stations)})
            voice = Flow("voice", ("sink",), udp_bytes(200), 200, quiet.arrivals, NS_PER_S // 50,
                         dscp=MARKS["voice"])
            found = play(_setup(quiet.radio, [*flows, voice], _QUIET_S))
            what = f"{quiet.radio}, {quiet.arrivals} voice beside {quiet.stations}"
            for name, measured in (("mean", quiet.mean_ms), ("p95", quiet.p95_ms)):
                yield _within(0.05, f"{what}: delay, {name}",
                              found[f"delay_{name}_ms_by_mark"][str(MARKS["voice"])], measured,
                              "ms")


def _goodput(by_mark: Mapping[str, float], category: str) -> float:
    return sum(by_mark.values()) if category == "all" else by_mark[str(MARKS[category])]


def _within(share: float, what: str, measured: float, published: Measured, unit: str) -> Check:
    mean, interval = published
    return Check(what, measured, mean, max(share * mean, interval), unit)
