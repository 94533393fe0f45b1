"""Counts of messages, packets and bytes on the media."""

from __future__ import annotations

from desim.middleware.graph import Graph
from desim.monitor.meters.meter import Meter
from desim.monitor.samples import Sample
from desim.monitor.traffic import packets_lost, totals
from desim.monitor.utilisation import utilisation, utilisation_inside
from desim.ports import KnowsHandovers
from desim.units import NS_PER_S


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
                # They left a subscription's full queue unread: a newer one took their place.
                "messages_replaced": sum([topic.counts.overwritten
                                          for topic in graph.topics.values()]),
                "bytes_on_air": traffic.bytes_on_air,
                "packets_lost": packets_lost(graph),
                "background": [
                    {"medium": flow.medium.name, "between": list(flow.between), "sent": flow.sent,
                     "delivered": flow.delivered, "dropped": dict(sorted(flow.dropped.items())),
                     "in_flight": flow.in_flight} for flow in graph.background],
                "utilisation": {**{medium.name: utilisation(medium, now_ns)
                                   for medium in graph.media},
                                **utilisation_inside(graph.inside, now_ns)},
                "control_bytes": sum(medium.control_bytes for medium in graph.media),
                **_access_points(graph)}


def _access_points(graph: Graph) -> Sample:
    """The access points of media, and each time that a host has come to one."""
    known = [(medium, medium.model) for medium in graph.media
             if isinstance(medium.model, KnowsHandovers)]
    if not known:
        return {}
    arrivals = [(medium, one) for medium, model in known for one in model.handovers
                if one.host in medium.attached]
    gaps_ns = [one.gap_ns for _, one in arrivals]
    return {"access_points": [{"medium": medium.name, **one._asdict()}
                              for medium, model in known for one in model.access_points],
            "handovers": [
                {"time_s": one.time_ns / NS_PER_S, "medium": medium.name,
                 "host": medium.hosts[one.host], "from": one.left, "to": one.access_point,
                 "gap_s": one.gap_ns / NS_PER_S} for medium, one in arrivals],
            "handover_gap_s": {"count": len(gaps_ns), "total": sum(gaps_ns) / NS_PER_S,
                               "max": max(gaps_ns, default=0) / NS_PER_S}}
