"""Topics by family, ``/robot_3/scan`` with all other scans: bytes, fates and latency."""

from __future__ import annotations

from collections import Counter
from functools import cache

import numpy as np

from desim.middleware.counts import EDGES_NS
from desim.middleware.graph import Graph
from desim.monitor.meters.meter import Due, Meter
from desim.monitor.samples import Sample
from desim.monitor.traffic import KINDS, family, kind
from desim.units import NS_PER_S

BYTES = "bytes_per_s"  # of a sample: the bytes by family so far, of which the table makes rates


class TopicFamilies(Meter):
    """Measures the topics of ``graph`` by family, each name worked out once."""

    def __init__(self, graph: Graph) -> None:
        hosts = frozenset(host.name for host in graph.hosts)
        self._graph, self._of = graph, cache(lambda topic: family(topic, hosts))

    def sample(self, now_ns: int, due: Due) -> Sample:
        """Bytes delivered so far between hosts, without headers, by family."""
        out: Counter[str] = Counter()
        for name, topic in self._graph.topics.items():
            if topic.counts.intended:
                out[self._of(name)] += topic.counts.bytes
        return {BYTES: out}

    def summary(self, now_ns: int) -> Sample:
        return {"traffic": by_kind(self._graph), "messages_by_topic": self._fates(),
                "latency_by_topic": self._latency()}

    def _fates(self) -> dict[str, dict[str, int]]:
        """The fates of each family's messages: published = delivered + dropped + unmatched +
        in flight, one per message and receiving host; and the bytes delivered."""
        out: dict[str, Counter[str]] = {}
        for name, topic in self._graph.topics.items():
            counts = topic.counts
            if counts.published:
                out.setdefault(self._of(name), Counter()).update(
                    published=counts.published, delivered=counts.delivered,
                    dropped=sum(counts.dropped.values()), unmatched=counts.unmatched,
                    in_flight=counts.in_flight, bytes=counts.bytes)
        return {key: dict(out[key]) for key in sorted(out)}

    def _latency(self) -> dict[str, dict[str, float]]:
        """By family: deliveries, and median, 95th percentile and longest latency in seconds,
        rounded up to the edge of a histogram bin (at most 12.2 % too high)."""
        bins: dict[str, np.ndarray] = {}
        for name, topic in self._graph.topics.items():
            if topic.counts.delivered:
                key = self._of(name)
                bins[key] = bins.get(key, 0) + topic.counts.latencies
        return {key: {"count": int(own.sum()), "p50_s": _quantile_s(own, 0.5),
                      "p95_s": _quantile_s(own, 0.95), "max_s": _quantile_s(own, 1.0)}
                for key, own in sorted(bins.items())}


def by_kind(graph: Graph) -> dict[str, dict[str, int]]:
    """Messages sent, delivered and dropped between hosts, and bytes delivered, by kind; also those
    of which there are none."""
    out = {kind: Counter(sent=0, delivered=0, dropped=0, bytes=0) for kind in KINDS}
    for name, topic in graph.topics.items():
        counts = topic.counts
        out[kind(name)].update(sent=counts.intended, delivered=counts.delivered,
                               dropped=sum(counts.dropped.values()), bytes=counts.bytes)
    return {kind: dict(own) for kind, own in out.items()}


def _quantile_s(bins: np.ndarray, q: float) -> float:
    at = int(np.searchsorted(np.cumsum(bins), q * bins.sum()))
    return int(EDGES_NS[min(at, len(EDGES_NS) - 1)]) / NS_PER_S
