"""Access points of 802.11n, ac and ax, saturated and under load, against ns-3.

Stations and access point have equal powers everywhere. Block acknowledgements were agreed on
before, addresses were known, and ns-3's queues have no limit. Beacons take no airtime here: ns-3's
come before all that waits, behind an idle medium of PIFS, ours contend as data do.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from desim.ports.cases import NOWHERE, Check, Flow, Play, Setup
from desim.units import NS_PER_S
from netmodels.cases.traffic import SAME_POWER, numbered, udp_bytes
from netmodels.radio.radio import Radio
from netmodels.validation.tolerance import within

_PAYLOAD_BYTES = 1000
_SERVER = "server"
# Packets of each flow that are on the way at any time, more than two aggregates, in two trains.
_BACKLOG, _TRAIN = 128, 65
_ALONE_S, _CONTENDING_S = 3, 30  # that are measured; at 80 MHz a quarter of the latter


class Fate(NamedTuple):
    """Mb/s of payload in all, and the share of data and of requests for block acknowledgements
    that got no reply."""

    goodput_mbps: float
    failures: float


# By standard, MCS, MHz and whether packets are aggregated: who sends, and stations. Means of four
# runs of 8 s, at 80 MHz of 5 s, one where nobody contends.
SATURATED: dict[tuple[str, int, int, bool], dict[tuple[str, int], Fate]] = {
    ("11n", 7, 20, True): {
        ("up", 1): Fate(58.366, 0), ("up", 5): Fate(47.893, .2685), ("up", 10): Fate(42.032, .3749),
        ("up", 30): Fate(31.878, .5374), ("down", 1): Fate(58.376, 0), ("down", 5): Fate(58.365, 0),
        ("down", 10): Fate(58.385, 0), ("down", 30): Fate(58.373, 0),
        ("both", 5): Fate(46.522, .2953), ("both", 10): Fate(40.854, .3957)},
    ("11n", 7, 20, False): {
        ("up", 1): Fate(24.753, 0), ("up", 5): Fate(25.381, .2648), ("up", 10): Fate(24.118, .3761),
        ("down", 1): Fate(24.775, 0), ("down", 5): Fate(24.762, 0), ("down", 10): Fate(24.742, 0)},
    ("11ax", 0, 80, True): {("up", 10): Fate(22.703, .3777), ("down", 10): Fate(31.795, 0)},
    ("11ax", 4, 80, True): {("up", 10): Fate(132.852, .3770)},
    ("11ax", 7, 80, True): {("up", 10): Fate(211.141, .3739)},
}


class AccessPointsOfNs3:
    """Stations under an access point, as in ns-3: goodput within 3 %, failures within 0.02."""

    source = "ns-3.44, ApWifiMac and StaWifiMac, best effort, every pair at -50 dBm"

    def checks(self, play: Play) -> Iterator[Check]:
        for (standard, mcs, mhz, aggregation), rows in SATURATED.items():
            for (direction, stations), row in rows.items():
                found = play(saturated(standard, mcs, mhz, aggregation, direction, stations,
                                       _seconds(direction, mhz)))
                alone = "" if aggregation else "no aggregates, "
                what = f"{standard}, MCS {mcs}, {mhz} MHz, {alone}{stations} stations, {direction}"
                yield from _compared(what, found, row)


def _seconds(direction: str, mhz: int) -> int:
    return _ALONE_S if direction == "down" else _CONTENDING_S * 20 // mhz


def _compared(what: str, found: Mapping[str, float], row: Fate) -> Iterator[Check]:
    yield within(0.03, f"{what}: goodput", found["goodput_mbps"], row.goodput_mbps, "Mb/s")
    yield Check(f"{what}: failures", found["failure_rate"], row.failures, 0.02)


def saturated(standard: str, mcs: int, mhz: int, aggregation: bool, direction: str, stations: int,
              seconds: int) -> Setup:
    """The network of ns-3, and ``seconds`` of it: saturated flows from all stations to a server
    behind the access point (``up``), from that to all (``down``), or ``both``. Cables take no time,
    and nothing is lost in queues."""
    radio = Radio.build(Radio.Params.model_validate({
        "preset": "ns3_3_44", "standard": standard, "channel": 36, "mcs": mcs,
        "width": f"{mhz} MHz", "aggregation": aggregation, "path_loss": SAME_POWER, "queue": 10_000,
        "access_points": [{"at": ["0 m", "0 m"], "channel": 36, "height": "0.5 m"}],
        "infrastructure": {
            "wired": [_SERVER], "wires": {"rate": "100 Gb/s", "propagation": "0 ns"},
            "queue": "fifo", "constants": {"beacon_frame": None}}}))
    hosts = numbered("station", stations)
    up = [(host, _SERVER) for host in hosts]
    down = [(_SERVER, host) for host in hosts]
    flows = [Flow(source, (receiver,), udp_bytes(_PAYLOAD_BYTES), _PAYLOAD_BYTES, backlog=_BACKLOG,
                  train=_TRAIN)
             for source, receiver in {"up": up, "down": down, "both": up + down}[direction]]
    return Setup(radio, dict.fromkeys([*hosts, _SERVER], NOWHERE), flows,
                 (1 + seconds) * NS_PER_S, NS_PER_S)
