"""Stations of several access categories on one air, against ns-3."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from desim.ports.cases import NOWHERE, Check, Flow, Play, Setup
from desim.units import NS_PER_S
from netmodels.cases.traffic import SAME_POWER, udp_bytes
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.dcf.stations import Aggregation
from netmodels.validation.tolerance import within

# The marks of categories, as in class selectors and expedited forwarding.
MARKS = {"background": 8, "best_effort": 0, "video": 34, "voice": 48}
RADIOS: dict[str, dict[str, object]] = {
    "11n": {"standard": "11n", "mcs": 4, "channel": 36, "aggregation": False},
    "11n, aggregates": {"standard": "11n", "mcs": 4, "channel": 36},
    "11a": {"standard": "11a", "rate": "24 Mb/s", "qos": True},
}


class Saturated(NamedTuple):
    """Stations that are saturated in one category each, by category; Mb/s of 1000 B of UDP that
    some and all of them carry, and the share of transmissions of data without a reply."""

    radio: str
    stations: dict[str, int]
    goodput_mbps: dict[str, float]
    failures: float


SATURATED = (
    Saturated("11n", {"best_effort": 1, "voice": 1}, {"voice": 23.121, "all": 23.304}, 0.0135),
    Saturated("11n", {"best_effort": 5, "voice": 2}, {"voice": 20.500, "all": 21.791}, 0.1565),
    Saturated("11n", {"best_effort": 5, "voice": 5}, {"voice": 20.278, "all": 20.386}, 0.2974),
    Saturated("11a", {"best_effort": 1, "voice": 1}, {"voice": 16.586, "all": 16.760}, 0.0175),
    Saturated("11a", {"best_effort": 5, "voice": 2}, {"voice": 14.134, "all": 15.327}, 0.1971),
    Saturated("11a", {"best_effort": 5, "voice": 5}, {"voice": 13.898, "all": 13.958}, 0.3619),
)

_WARM_UP_NS = NS_PER_S
_DURATION_S = 20


def radio(name: str) -> DcfRadio:
    """One of ``RADIOS``, whose stations all hear each other equally well."""
    return DcfRadio(DcfRadio.Params(preset="ns3_3_44", path_loss=SAME_POWER, **RADIOS[name]))


def saturated(name: str, senders: Mapping[str, tuple[str, ...]]) -> Setup:
    """Hosts that are saturated in one category or several, to one receiver."""
    backlog = 2 * Aggregation().packets if name.endswith("aggregates") else 0
    flows = [Flow(host, ("sink",), udp_bytes(1000), 1000, backlog=backlog, dscp=MARKS[category])
             for host, own in senders.items() for category in own]
    return Setup(radio(name), dict.fromkeys((*senders, "sink"), NOWHERE), flows,
                 _WARM_UP_NS + _DURATION_S * NS_PER_S, _WARM_UP_NS)


class AccessCategories:
    """Voice, video, best effort and background on one air, as in ns-3: goodput within 3 %, failures
    within 0.02."""

    source = ("ns-3.44, AdhocWifiMac with QoS, TXOP limits of Linux (voice: 1.504 ms), every pair "
              "at -50 dBm")

    def checks(self, play: Play) -> Iterator[Check]:
        for row in SATURATED:
            senders = [(category,) for category, count in row.stations.items()
                       for _ in range(count)]
            found = play(saturated(row.radio, {
                f"sender_{k}": own for k, own in enumerate(senders)}))
            what = f"{row.radio}, " + " and ".join(
                f"{count} {category}" for category, count in row.stations.items())
            yield from _compared(what, found, row.goodput_mbps, row.failures)


def _compared(what: str, found: Mapping[str, Any], goodput_mbps: Mapping[str, float],
              failures: float) -> Iterator[Check]:
    for category, mbps in goodput_mbps.items():
        measured = (found["goodput_mbps"] if category == "all" else
                    found["goodput_mbps_by_mark"][str(MARKS[category])])
        yield within(0.03, f"{what}: goodput of {category}", measured, mbps, "Mb/s")
    yield Check(f"{what}: failures", found["failure_rate"], failures, 0.02)
