"""Cases for the radio tests: stations in a place, and what saturates them."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import NamedTuple

import numpy as np

from desim.network.carrier import Carrier
from netmodels.radio.dcf.stations import DROPPED, NEVER, RECEIVED, Reception, Stations
from netmodels.radio.errors import error_table
from netmodels.radio.standards import Standard

NS3 = Reception(energy_dbm=-82.0, unaware=True, gives_up=True, eifs_at_end=True)
LINKS = {"path_loss": {"reference": "46.6777 dB"},  # ns-3's: 6 to 18 Mb/s get 51.46 m far
         "reception": {"preamble": "-82 dBm"}}
UDP_BYTES = 1046  # 1000 B of UDP with Ethernet's headers: 1064 B on the air
EVERYBODY_MW = 1e-5  # -50 dBm: the rows where nobody captures anything


def rows(path: Path, **wanted: str) -> list[dict[str, str]]:
    """The rows of a CSV with these values."""
    with path.open(newline="") as file:
        return [row for row in csv.DictReader(file)
                if all(row[name] == value for name, value in wanted.items())]


def same_power(stations: int) -> np.ndarray:
    return np.full((stations, stations), EVERYBODY_MW)


def by_distance(*places: tuple[float, float]) -> np.ndarray:
    """Received powers in mW as in the tables with places: log-distance(3, 46.6777 dB), 16.0206 dBm.
    """
    at = np.array(places, dtype=float)
    distance_m = np.maximum(np.linalg.norm(at[:, None] - at[None], axis=2), 1.0)
    return 10 ** ((16.0206 - 46.6777 - 30 * np.log10(distance_m)) / 10)


def air(standard: Standard, power_mw: np.ndarray, seed: int = 1, *,
        reception: Reception = NS3, reset_at: int = 8, **options) -> Stations:
    """By default as in ns-3."""
    n = len(power_mw)
    keys = np.random.default_rng(seed).integers(2 ** 63, size=n).astype(np.uint64)
    errors = error_table(tuple(rate.scheme for rate in standard.rates))
    stations = Stations(standard, keys, errors, reception, reset_at=reset_at, **options)
    near = ~np.eye(n, dtype=bool) & (power_mw > 1e-13)
    source, hearer = np.nonzero(near)
    first = np.concatenate([[0], np.cumsum(near.sum(axis=1))])
    stations.link(0, first, hearer, power_mw[source, hearer])
    return stations


class Saturation(NamedTuple):
    """Packets a second, failed transmissions of data to all, frames given up to all settled."""

    packets_per_s: float
    failure_rate: float
    drop_rate: float


def saturate(stations: Stations, flows: list[tuple[int, int]], psdu_bytes: int, rate: int,
             seconds: float, warm_up: float = 0.5, rts: bool = False) -> Saturation:
    """Every flow has two packets in its queue, always."""
    end_ns, warm_ns, dest = int(seconds * 1e9), int(warm_up * 1e9), dict(flows)
    for source, to in flows * 2:
        stations.enqueue(0, source, to, psdu_bytes, rate, rts=rts)
    settled, before = {RECEIVED: 0, DROPPED: 0}, None
    while (now_ns := stations.next_ns) <= end_ns:
        if before is None and now_ns > warm_ns:
            before = stations.counts(warm_ns)
            settled = dict.fromkeys(settled, 0)
        for _, what, source, *_ in stations.advance(now_ns):
            settled[what] += 1
            stations.enqueue(now_ns, source, dest[source], psdu_bytes, rate, rts=rts)
    after = stations.counts(end_ns)
    transmitted = int((after.transmitted - before.transmitted).sum())
    return Saturation(settled[RECEIVED] / (seconds - warm_up),
                      int((after.failures - before.failures).sum()) / transmitted,
                      settled[DROPPED] / sum(settled.values()))


def heartbeats(stations: Stations, times_ns: list[tuple[int, int]], psdu_bytes: int, rate: int,
               n: int) -> float:
    """The share of copies received when each (time, station) sends to the n - 1 others."""
    def received_next() -> int:
        return sum(what == RECEIVED for _, what, *_ in stations.advance(stations.next_ns))

    received = 0
    for time_ns, source in sorted(times_ns):
        while stations.next_ns <= time_ns:
            received += received_next()
        stations.enqueue(time_ns, source, -1, psdu_bytes, rate)
    while stations.next_ns < NEVER:
        received += received_next()
    return received / (len(times_ns) * (n - 1))


class Flow(Carrier):
    """Two packets of ``source`` for ``dest`` are in its queue, always."""

    def __init__(self, medium, source, dest):
        self.medium, self.source, self.dest, self.received = medium, source, dest, 0
        for _ in range(2):
            self.offer()

    def offer(self):
        self.medium.transmit(self.source, (self.dest,), UDP_BYTES, 1, False, self, None)

    def arrived(self, token, receiver):
        self.received += 1
        self.offer()

    def lost(self, token, receiver, reason):
        self.offer()
