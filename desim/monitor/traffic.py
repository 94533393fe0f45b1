"""The traffic of a run so far: sums over what the graph counts for each topic and medium."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

from desim.middleware.counts import EDGES_NS
from desim.middleware.graph import Graph

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
    sent = unmatched = 0
    dropped: dict[str, int] = {}
    for topic in tuple(graph.topics.values()):
        counts = topic.counts
        sent += counts.intended
        unmatched += counts.unmatched
        for reason, count in tuple(counts.dropped.items()):
            dropped[reason] = dropped.get(reason, 0) + count
    return Totals(sent, int(graph.arrivals.tallies.counts.sum()), dropped, unmatched,
                  sum([medium.bytes_on_air for medium in graph.media]))


def family(topic: str, hosts: frozenset[str]) -> str:
    """The topic without the name of a host: ``/robot_3/scan`` to ``/*/scan``."""
    return "/".join(["*" if part in hosts else part for part in topic.split("/")])


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


def packets_lost(graph: Graph) -> dict[str, int]:
    """The packets that media have lost, by reason, without those of others."""
    lost: Counter[str] = Counter()
    for medium in graph.media:
        lost.update(medium.packets_dropped)
    for flow in graph.background:
        lost.subtract(flow.dropped)
    return {reason: lost[reason] for reason in sorted(lost) if lost[reason] > 0}


def latency_table(graph: Graph) -> dict[str, list]:
    """Columns topic, from_ns, to_ns, count: each topic's histogram, bins that hold something."""
    edges = [0, *EDGES_NS.tolist(), None]
    rows = [(name, edges[b], edges[b + 1], count)
            for name, topic in sorted(graph.topics.items()) if topic.counts.delivered
            for b, count in enumerate(topic.counts.latencies.tolist()) if count]
    return {column: [row[i] for row in rows]
            for i, column in enumerate(("topic", "from_ns", "to_ns", "count"))}
