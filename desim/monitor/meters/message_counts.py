"""Counts of messages, packets and bytes on the media."""

from __future__ import annotations

from desim.middleware.graph import Graph
from desim.monitor.meters.meter import Meter
from desim.monitor.samples import Sample
from desim.monitor.traffic import background, packets_lost, replaced, totals
from desim.monitor.utilisation import utilisation, utilisation_inside


class MessageCounts(Meter):
    """Counts what ``graph`` and its media carried."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph

    def quantities(self, now_ns: int) -> Sample:
        traffic = totals(self._graph)
        return {"messages_sent": traffic.sent,
                "messages_delivered": traffic.delivered,
                "messages_dropped": sum(traffic.dropped.values()),
                "bytes_on_air": traffic.bytes_on_air}

    def summary(self, now_ns: int) -> Sample:
        graph, traffic = self._graph, totals(self._graph)
        return {"messages_published": traffic.sent + traffic.unmatched,
                "messages_unmatched": traffic.unmatched,
                "messages_sent": traffic.sent,
                "messages_delivered": traffic.delivered,
                "messages_dropped": dict(sorted(traffic.dropped.items())),
                "messages_in_flight": traffic.in_flight,
                "messages_replaced": replaced(graph),
                "bytes_on_air": traffic.bytes_on_air,
                "packets_lost": packets_lost(graph),
                "background": background(graph),
                "utilisation": {**{medium.name: utilisation(medium, now_ns)
                                   for medium in graph.media},
                                **utilisation_inside(graph.inside, now_ns)},
                "control_bytes": sum(medium.control_bytes for medium in graph.media)}
