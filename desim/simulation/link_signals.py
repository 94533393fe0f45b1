"""The signal of a link, as a radio's driver reports it: the power of received frames."""

from __future__ import annotations

from desim.middleware.graph import Graph
from desim.network.medium import Medium
from desim.network.surroundings import Surroundings
from desim.ports import HearsAntennas, PredictsSignal


class LinkSignals:
    """Signals between the hosts of ``graph``, which stand at ``place``."""

    def __init__(self, graph: Graph, place: Surroundings) -> None:
        self._graph, self._place = graph, place

    def power_dbm(self, receiver: str, sender: str) -> float | None:
        """The power at which ``receiver`` hears ``sender`` now; None if nothing gets through, if
        other hosts forward between them, or if the network model has no signals."""
        graph = self._graph
        to, from_ = graph.host(receiver), graph.host(sender)
        medium = graph.routes.at_present(to, from_.index)
        if not isinstance(medium, Medium) or not graph.up[from_.index]:
            return None
        if isinstance(medium.model, HearsAntennas):
            signal = medium.model.link_signal(from_.index, to.index)
        elif isinstance(medium.model, PredictsSignal):
            positions = self._place.positions(graph.kernel.now_ns)
            signal = medium.model.signal(positions[from_.index], positions[to.index][None])
        else:
            return None
        return float(signal.power_dbm[0]) if signal.delivery[0] > 0 else None
