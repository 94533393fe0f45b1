"""Reachability of hosts, sampled once a second and stored as changes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from desim.middleware.graph import Graph
from desim.monitor.meters.meter import Meter, Second
from desim.units import NS_PER_S

Pair = tuple[str, str]  # from, to


class SampledReachability(Meter):
    """Samples ``Graph.linked`` of all hosts, be they up or not, and keeps the changes."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self._all = np.arange(len(graph.hosts))
        self._linked = np.zeros((len(self._all), len(self._all)), bool)
        self._changes: list[tuple[int, int, int, bool]] = []

    def each_second(self, second: Second) -> None:
        self.note(second.now_ns)

    def note(self, now_ns: int) -> None:
        """Note the links that have changed since the last time."""
        linked = self._graph.linked(self._all)
        linked = np.ones_like(self._linked) if linked is None else linked.copy()
        np.fill_diagonal(linked, False)
        self._changes += [(now_ns, one, other, bool(linked[one, other]))
                          for one, other in np.argwhere(linked != self._linked).tolist()]
        self._linked = linked

    def table(self) -> dict[str, np.ndarray]:
        """A row a change: time_s, host, other, linked. In the beginning nobody is linked."""
        names = [host.name for host in self._graph.hosts]
        return {"time_s": np.array([row[0] for row in self._changes], float) / NS_PER_S,
                "host": np.array([names[row[1]] for row in self._changes], str),
                "other": np.array([names[row[2]] for row in self._changes], str),
                "linked": np.array([row[3] for row in self._changes], bool)}


def linked_at(table: Mapping[str, np.ndarray], at_ns: int) -> dict[Pair, bool]:
    """The state of each pair after the rows of a ``table`` up to ``at_ns``; a pair without rows is
    not linked."""
    then = np.rint(table["time_s"] * NS_PER_S) <= at_ns
    host, other, linked = (table[name][then].tolist() for name in ("host", "other", "linked"))
    return dict(zip(zip(host, other, strict=True), linked, strict=True))
