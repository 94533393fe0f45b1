"""The traffic of a run so far: sums over what the graph counts for each topic and medium."""

from __future__ import annotations

from collections import Counter
from functools import cache
from typing import NamedTuple

import numpy as np

from desim.middleware.counts import EDGES_NS
from desim.middleware.graph import Graph
from desim.units import NS_PER_S

KINDS = ("coordination", "monitoring", "simulation", "other")
SENSORS = frozenset({"scan", "odom", "true_pose", "cmd_vel", "tf", "bumper",
                     "sonar"})
MONITORING = frozenset({"explored_map", "distance", "cost", "gain"})


class Totals(NamedTuple):
    """Counts of messages between hosts, one per message and receiving host; ``unmatched`` ones are
    not among those ``sent``. ``bytes_on_air`` has headers and repetitions, each broadcast once, and
    nothing that a model refused to take."""

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
    counts = [topic.counts for topic in tuple(graph.topics.values())]
    dropped: dict[str, int] = {}
    for own in counts:
        for reason, count in tuple(own.dropped.items()):
            dropped[reason] = dropped.get(reason, 0) + count
    return Totals(sum(own.intended for own in counts), sum(own.delivered for own in counts),
                  dropped, sum(own.unmatched for own in counts),
                  sum(medium.bytes_on_air for medium in graph.media))


def family(topic: str, hosts: frozenset[str]) -> str:
    """The topic without the name of a host: ``/robot_3/scan`` to ``/*/scan``."""
    return "/".join("*" if part in hosts else part for part in topic.split("/"))


def kind(topic: str) -> str:
    """The paper's three kinds of traffic: between simulator and controllers, among controllers,
    and from controllers to the monitor; and what a scenario adds. A fleet's common ``/tf`` is among
    controllers."""
    topic = topic.partition("/copy_")[0]  # for another process of a host
    last = topic.rpartition("/")[2]
    if topic == "/tf" or topic.startswith("/map_exchange/") or "/strategy/" in topic \
            or last == "team_state":
        return "coordination"
    if last in SENSORS:
        return "simulation"
    return "monitoring" if last in MONITORING else "other"


class Families:
    """The topics of a graph by family, each name worked out once."""

    def __init__(self, graph: Graph) -> None:
        hosts = frozenset(host.name for host in graph.hosts)
        self._graph, self._of = graph, cache(lambda topic: family(topic, hosts))

    def bytes(self) -> dict[str, int]:
        """Bytes delivered between hosts, without headers, by family."""
        out: Counter[str] = Counter()
        for name, topic in self._graph.topics.items():
            if topic.counts.intended:
                out[self._of(name)] += topic.counts.bytes
        return out

    def fates(self) -> dict[str, dict[str, int]]:
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


def by_kind(graph: Graph) -> dict[str, dict[str, int]]:
    """Messages sent, delivered and dropped between hosts, and bytes delivered, by kind; also those
    of which there are none."""
    out = {kind: Counter(sent=0, delivered=0, dropped=0, bytes=0) for kind in KINDS}
    for name, topic in graph.topics.items():
        counts = topic.counts
        out[kind(name)].update(sent=counts.intended, delivered=counts.delivered,
                               dropped=sum(counts.dropped.values()), bytes=counts.bytes)
    return {kind: dict(own) for kind, own in out.items()}


def replaced(graph: Graph) -> int:
    """The messages that left a subscription's full queue unread: a newer one took their place."""
    return sum(topic.counts.overwritten for topic in graph.topics.values())


def packets_lost(graph: Graph) -> dict[str, int]:
    """The packets that media have lost, by reason, without those of others."""
    lost: Counter[str] = Counter()
    for medium in graph.media:
        lost.update(medium.packets_dropped)
    for flow in graph.background:
        lost.subtract(flow.dropped)
    return {reason: lost[reason] for reason in sorted(lost) if lost[reason] > 0}


def background(graph: Graph) -> list[dict[str, object]]:
    """Background traffic: the packets of each flow, which are sent = delivered + dropped + in
    flight."""
    return [{"medium": flow.medium.name, "between": list(flow.between), "sent": flow.sent,
             "delivered": flow.delivered, "dropped": dict(sorted(flow.dropped.items())),
             "in_flight": flow.in_flight} for flow in graph.background]


def latency_table(graph: Graph) -> dict[str, list]:
    """Columns topic, from_ns, to_ns, count: each topic's histogram, bins that hold something."""
    edges = [0, *EDGES_NS.tolist(), None]
    rows = [(name, edges[b], edges[b + 1], count)
            for name, topic in sorted(graph.topics.items()) if topic.counts.delivered
            for b, count in enumerate(topic.counts.latency.bins().tolist()) if count]
    return {column: [row[i] for row in rows]
            for i, column in enumerate(("topic", "from_ns", "to_ns", "count"))}


def _quantile_s(bins: np.ndarray, q: float) -> float:
    at = int(np.searchsorted(np.cumsum(bins), q * bins.sum()))
    return int(EDGES_NS[min(at, len(EDGES_NS) - 1)]) / NS_PER_S
