"""The pairs of processes that have found each other, once a second."""

from __future__ import annotations

from desim.middleware.graph import Graph
from desim.monitor.meters.meter import Due, Meter, Second
from desim.monitor.samples import Sample
from desim.ports.middleware import CountsPairs
from desim.units import NS_PER_S


class ProcessPairs(Meter):
    """Asks the middleware of ``graph``, if it knows (``CountsPairs``)."""

    def __init__(self, graph: Graph) -> None:
        self._middleware = graph.middleware if isinstance(graph.middleware, CountsPairs) else None
        self._all_s: float | None = None

    def each_second(self, second: Second) -> None:
        matched, pairs = self._pairs()
        if matched < pairs:
            self._all_s = None
        elif self._all_s is None and pairs:
            self._all_s = second.now_ns / NS_PER_S

    def sample(self, now_ns: int, due: Due) -> Sample:
        matched, pairs = self._pairs()
        return {"matched_pairs": matched / pairs} if pairs else {}

    def summary(self, now_ns: int) -> Sample:
        matched, pairs = self._pairs()
        return {"process_pairs": {"matched": matched, "pairs": pairs, "all_s": self._all_s}
                } if pairs else {}

    def _pairs(self) -> tuple[int, int]:
        return (0, 0) if self._middleware is None else self._middleware.pairs()
