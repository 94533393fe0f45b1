"""The power at which radios receive each other: what a driver reports as a link's signal."""

from __future__ import annotations

from desim.middleware.graph import Graph
from desim.network.surroundings import Surroundings
from desim.ports import PredictsSignal


class LinkSignals:
    """Signals between the hosts of ``graph``, which stand at ``place``."""

    def __init__(self, graph: Graph, place: Surroundings) -> None:
        self._graph, self._place = graph, place

    def power_dbm(self, receiver: str, sender: str) -> float | None:
        """The power at which ``receiver`` hears ``sender`` now; None where nothing gets through,
        or the network model is no ``PredictsSignal``."""
        graph = self._graph
        to, from_ = graph.host(receiver), graph.host(sender)
        medium = graph.route(to, from_.index)
        if medium is None or not graph.up[from_.index] \
                or not isinstance(medium.model, PredictsSignal):
            return None
        positions = self._place.positions(graph.kernel.now_ns)
        signal = medium.model.signal(positions[from_.index], positions[to.index][None])
        return float(signal.power_dbm[0]) if signal.delivery[0] > 0 else None
