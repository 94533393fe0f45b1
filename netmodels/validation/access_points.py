"""Access points of 802.11n, ac and ax, saturated and under load, against ns-3.

Stations and access point have equal powers everywhere, unless half of the stations are hidden from
the other half, or they stand at different distances. Block acknowledgements were agreed on before,
addresses were known, and ns-3's queues have no limit.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping
from importlib.resources import files
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from desim.ports.cases import NOWHERE, Check, Flow, Play, Setup
from desim.units import NS_PER_S
from netmodels.cases.traffic import SAME_POWER, numbered, udp_bytes
from netmodels.radio.radio import Radio

_PAYLOAD_BYTES = 1000
_SERVER = "server"
# Packets of each flow that are on the way at any time, more than two aggregates, in two trains.
_BACKLOG, _TRAIN = 128, 65
# Packets a second of stations that send to each other, more than the air carries: the access point
# is full, and its stations send all the same.
_OVERLOAD_PER_S = 4000
_BEACON = "138 B"
# Two sides that do not hear each other, with -60 dBm at the access point between them.
_SIDES_M = 2.0
_FAR_APART = {"model": "log_distance", "exponent": 10, "reference": "46.6777 dB"}
_ALONE_S, _RELAYED_S, _CONTENDING_S, _POISSON_S = 3, 15, 40, 20  # that are measured


class ApRow(NamedTuple):
    """Means of runs of ns-3, and half of their 95 % intervals: Mb/s of payload in all, the share of
    data and of requests for block acknowledgements that got no reply, and of Poisson flows with
    ``per_s`` packets a second (0: saturated) the delay. Stations stand on a spiral, one turn from
    ``near_m`` to ``far_m`` away from the access point (0: equal powers)."""

    standard: str
    mcs: int
    mhz: int
    aggregates: bool
    direction: str
    stations: int
    near_m: float
    far_m: float
    hidden: bool
    rts: bool
    per_s: float
    goodput_mbps: float
    goodput_error: float
    failures: float
    delay_ms: float
    delay_error: float

    def __str__(self) -> str:
        words = [self.standard, f"MCS {self.mcs}", f"{self.mhz} MHz",
                 *([] if self.aggregates else ["no aggregates"]),
                 f"{self.stations} stations", self.direction,
                 *([f"{self.near_m:g} to {self.far_m:g} m"] if self.near_m else []),
                 *(["hidden"] if self.hidden else []), *(["RTS"] if self.rts else []),
                 *([f"{self.per_s:g} packets/s"] if self.per_s else [])]
        return ", ".join(words)


def rows() -> list[ApRow]:
    """All of ns-3's. ``access_points_of_ns3.csv`` has them as text, flags as 0 and 1."""
    table = files("netmodels.validation") / "access_points_of_ns3.csv"
    return [ApRow(one["standard"], int(one["mcs"]), int(one["mhz"]), one["aggregates"] == "1",
                  one["direction"], int(one["stations"]), float(one["near_m"]),
                  float(one["far_m"]), one["hidden"] == "1", one["rts"] == "1",
                  *(float(one[name]) for name in ApRow._fields[10:]))
            for one in csv.DictReader(table.read_text(encoding="utf-8").splitlines())]


class AccessPointsOfNs3:
    """Stations under an access point, as in ns-3: goodput within 3 % or ns-3's interval, failures
    within 0.02, delays within 5 % or the interval."""

    source = "ns-3.44, ApWifiMac and StaWifiMac, best effort, every pair at -50 dBm"

    def checks(self, play: Play) -> Iterator[Check]:
        for row in rows():
            yield from _compared(row, play(network(row, _seconds(row))))


def _compared(row: ApRow, found: Mapping[str, float]) -> Iterator[Check]:
    if row.per_s:
        yield Check(f"{row}: delay", found["delay_mean_ms"], row.delay_ms,
                    max(0.05 * row.delay_ms, row.delay_error), "ms")
    else:
        yield Check(f"{row}: goodput", found["goodput_mbps"], row.goodput_mbps,
                    max(0.03 * row.goodput_mbps, row.goodput_error), "Mb/s")
        if not row.rts:  # ns-3 counts those of data alone
            yield Check(f"{row}: failures", found["failure_rate"], row.failures, 0.02)


def _flows(row: ApRow) -> list[Flow]:
    """Flows from all stations to a server behind the access point (``up``), from that to all
    (``down``), ``both``, or from each station to the next one (``relay``)."""
    hosts = numbered("station", row.stations)
    up = [(host, _SERVER) for host in hosts]
    down = [(_SERVER, host) for host in hosts]
    relay = list(zip(hosts, (*hosts[1:], hosts[0]), strict=True))
    pairs = {"up": up, "down": down, "both": up + down, "relay": relay}[row.direction]
    size_bytes = udp_bytes(_PAYLOAD_BYTES)
    per_s = row.per_s or _OVERLOAD_PER_S * (row.direction == "relay")
    if per_s:
        return [Flow(source, (receiver,), size_bytes, _PAYLOAD_BYTES, "poisson",
                     round(NS_PER_S / per_s)) for source, receiver in pairs]
    return [Flow(source, (receiver,), size_bytes, _PAYLOAD_BYTES, backlog=_BACKLOG, train=_TRAIN)
            for source, receiver in pairs]


def _seconds(row: ApRow) -> int:
    if row.per_s:
        return _POISSON_S
    if row.direction == "relay":
        return _RELAYED_S
    return _ALONE_S if row.direction == "down" else _CONTENDING_S


def saturated(direction: str, stations: int, seconds: int) -> Setup:
    """So many stations of 802.11n at MCS 7 that are saturated, and the packets of whose aggregates
    arrive together."""
    row = next(row for row in rows() if row.aggregates and not row.per_s and (
        row.direction, row.stations) == (direction, 5))._replace(stations=stations)
    return network(row, seconds, {"apart": False})


def network(row: ApRow, seconds: int, constants: Mapping[str, bool] = MappingProxyType({})
            ) -> Setup:
    """The network of a row, and ``seconds`` of it, with ``constants`` of the radio that differ from
    ns-3's. Cables take no time, and nothing is lost in queues."""
    flows, hosts = _flows(row), numbered("station", row.stations)
    path_loss = _FAR_APART if row.hidden else SAME_POWER
    radio = Radio.build(Radio.Params.model_validate({
        "preset": "ns3_3_44", "constants": {**constants}, "standard": row.standard,
        "channel": 36, "mcs": row.mcs,
        "width": f"{row.mhz} MHz", "aggregation": row.aggregates,
        **({} if row.near_m else {"path_loss": path_loss}),
        "queue": max(1000, 2 * _BACKLOG * len(flows)), **({"rts": "1 B"} if row.rts else {}),
        "access_points": [{"at": ["0 m", "0 m"], "channel": 36, "height": "0.5 m"}],
        "infrastructure": {
            "wired": [_SERVER], "wires": {"rate": "100 Gb/s", "propagation": "0 ns"},
            "queue": "fifo", "constants": {"beacon_frame": _BEACON}}}))
    places = dict.fromkeys((*hosts, _SERVER), NOWHERE)
    if row.hidden:
        places |= {host: (-_SIDES_M if 2 * k < row.stations else _SIDES_M, 0.0)
                   for k, host in enumerate(hosts)}
    if row.near_m:
        places |= dict(zip(hosts, _spiral(row), strict=True))
    return Setup(radio, places, flows, (1 + seconds) * NS_PER_S, NS_PER_S)


def _spiral(row: ApRow) -> list[tuple[float, float]]:
    away_m = np.linspace(row.near_m, row.far_m, row.stations)
    angle = 2 * np.pi * np.arange(row.stations) / row.stations
    return list(zip((away_m * np.cos(angle)).tolist(), (away_m * np.sin(angle)).tolist(),
                    strict=True))
