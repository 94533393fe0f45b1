"""The traffic of a run so far: sums over what the graph counts for each topic and medium."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from desim.middleware.counts import EDGES_NS
from desim.middleware.graph import Graph
from desim.units import NS_PER_S

KINDS = ("coordination", "monitoring", "simulation")
SENSORS = frozenset({"scan", "odom", "true_pose", "cmd_vel"})


class Totals(NamedTuple):
    """Between hosts, one per message and receiving host. ``unmatched`` stand beside those that are
    ``sent``. ``bytes_on_air`` count headers and repetitions, and each broadcast once, without what
    a model refused to take."""

    sent: int
    delivered: int
    dropped: dict[str, int]
    unmatched: int
    bytes_on_air: int

    @property
    def in_flight(self) -> int:
        return self.sent - self.delivered - sum(self.dropped.values())


def totals(graph: Graph) -> Totals:
    """All topics together."""
    sent = delivered = unmatched = 0
    dropped: dict[str, int] = {}
    for topic in tuple(graph.topics.values()):
        counts = topic.counts
        sent += counts.intended
        delivered += counts.delivered
        unmatched += counts.unmatched
        for reason, count in tuple(counts.dropped.items()):
            dropped[reason] = dropped.get(reason, 0) + count
    return Totals(sent, delivered, dropped, unmatched,
                  sum(medium.bytes_on_air for medium in graph.media))


def family(topic: str, hosts: frozenset[str]) -> str:
    """The topic without the name of a host: ``/robot_3/scan`` to ``/*/scan``."""
    return "/".join("*" if part in hosts else part for part in topic.split("/"))


def kind(topic: str) -> str:
    """The paper's three kinds of traffic: between simulator and controllers, among controllers,
    and from controllers to the monitor."""
    if topic.rpartition("/")[2] in SENSORS:
        return "simulation"
    return "coordination" if topic.startswith("/map_exchange/") else "monitoring"


class Families:
    """The topics of a graph by family, each name worked out once."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self._hosts = frozenset(host.name for host in graph.hosts)
        self._family: dict[str, str] = {}

    def bytes(self) -> dict[str, int]:
        """Bytes delivered between hosts, without headers, by family."""
        out: dict[str, int] = {}
        for name, topic in self._graph.topics.items():
            if topic.counts.intended:
                key = self._of(name)
                out[key] = out.get(key, 0) + topic.counts.bytes
        return out

    def fates(self) -> dict[str, dict[str, int]]:
        """The fates of each family's messages: published = delivered + dropped + unmatched +
        in flight, one per message and receiving host."""
        out: dict[str, dict[str, int]] = {}
        for name, topic in self._graph.topics.items():
            counts = topic.counts
            if counts.published:
                own = {"published": counts.published, "delivered": counts.delivered,
                       "dropped": sum(counts.dropped.values()), "unmatched": counts.unmatched,
                       "in_flight": counts.in_flight}
                known = out.get(self._of(name), dict.fromkeys(own, 0))
                out[self._of(name)] = {key: known[key] + count for key, count in own.items()}
        return dict(sorted(out.items()))

    def latency(self) -> dict[str, dict[str, float]]:
        """By family: deliveries, and median, 95th percentile and longest latency in seconds,
        rounded up to the edge of a histogram bin (at most 12.2 % too high)."""
        bins: dict[str, np.ndarray] = {}
        for name, topic in self._graph.topics.items():
            if topic.counts.delivered:
                key = self._of(name)
                bins[key] = bins.get(key, 0) + topic.counts.latency.bins()
        return {key: {"count": int(own.sum()), "p50_s": _quantile_s(own, 0.5),
                      "p95_s": _quantile_s(own, 0.95), "max_s": _quantile_s(own, 1.0)}
                for key, own in sorted(bins.items())}

    def _of(self, topic: str) -> str:
        known = self._family.get(topic)
        if known is None:
            known = self._family[topic] = family(topic, self._hosts)
        return known


def by_kind(graph: Graph, kind_of: Callable[[str], str] = kind) -> dict[str, dict[str, int]]:
    """Messages sent, delivered and dropped between hosts, and bytes delivered, by kind; those of
    ``KINDS`` also where there are none."""
    def nothing() -> dict[str, int]:
        return dict.fromkeys(("sent", "delivered", "dropped", "bytes"), 0)

    out = {kind: nothing() for kind in KINDS}
    for name, topic in sorted(graph.topics.items()):
        counts = topic.counts
        if counts.intended:
            own = out.setdefault(kind_of(name), nothing())
            own["sent"] += counts.intended
            own["delivered"] += counts.delivered
            own["dropped"] += sum(counts.dropped.values())
            own["bytes"] += counts.bytes
    return dict(sorted(out.items()))


def latency_table(graph: Graph) -> dict[str, list]:
    """Columns topic, from_ns, to_ns, count: each topic's histogram, bins that hold something."""
    edges = [0, *EDGES_NS.tolist(), None]
    out: dict[str, list] = {"topic": [], "from_ns": [], "to_ns": [], "count": []}
    for name, topic in sorted(graph.topics.items()):
        if topic.counts.delivered:
            bins = topic.counts.latency.bins()
            for b in np.flatnonzero(bins).tolist():
                row = (name, edges[b], edges[b + 1], int(bins[b]))
                for column, value in zip(out.values(), row, strict=True):
                    column.append(value)
    return out


def _quantile_s(bins: np.ndarray, q: float) -> float:
    at = int(np.searchsorted(np.cumsum(bins), q * bins.sum()))
    return int(EDGES_NS[min(at, len(EDGES_NS) - 1)]) / NS_PER_S
