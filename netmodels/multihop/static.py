"""Shortest paths, which every host knows at no cost."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import networkx
import numpy as np
from pydantic import Field

from desim import ports
from desim.units import Period, Ratio
from netmodels.hops import Hops

# From whom [k], to whom [k], and the share of packets [k] that arrive (``ports.KnowsLinks``).
KnownLinks = Callable[[], tuple[np.ndarray, np.ndarray, np.ndarray]]


class StaticParams(ports.Params):
    """Routes that an all-knowing administrator sets."""

    metric: Literal["hops", "etx"] = Field("etx", description=(
        "what is shortest: fewest hops, or fewest transmissions, 1 / (delivery there * delivery "
        "back) a hop (De Couto et al. 2003)"))
    usable: Ratio = Field("50 %", description="the least delivery of a hop either way, of a packet "
                                              "sent once (below that two good hops are better)")
    update_ns: Period | None = Field("1 s", description="between updates of the hosts' places, "
                                                        "while any moves (as batman's "
                                                        "interval; null: never again)")


class Static:
    """The shortest path over the hops that are usable, looked up in a table that is made anew when
    places, walls or hosts have changed and ``update`` has passed, or when ``recompute`` is called.
    It costs nothing on the air. Of paths of equal length the one whose next host is first in order
    is taken.
    """

    frames = bytes = 0  # it sends nothing

    def __init__(self, params: StaticParams, links: KnownLinks) -> None:
        self._params, self._links = params, links

    def start(self, hops: Hops, hosts: tuple[str, ...]) -> None:
        self._hops = hops
        self._updated_ns, self._epoch = 0, -1
        self._places: np.ndarray | None = None

    def next_hop(self, host: int, dest: int) -> int | None:
        """The host to which ``host`` gives a frame for ``dest``; None if there is no path."""
        if self._changed():
            self.recompute()
        towards = self._towards.get(dest)
        if towards is None:
            towards = self._towards[dest] = self._search(dest)
        return towards.get(host)

    def recompute(self) -> None:
        """Make the table anew, from the hosts' present places and from which of them are up."""
        hops = self._hops
        self._updated_ns = now_ns = hops.now_ns
        self._places, self._epoch = hops.positions(now_ns), hops.obstacles.epoch
        self._graph = _graph(self._params, np.array(hops.up), *self._links())
        self._towards: dict[int, dict[int, int]] = {}

    def switched(self, host: int, up: bool) -> None:
        """Nothing to do: a host that is down has no place, which is seen like a move."""

    def _changed(self) -> bool:
        hops, update_ns = self._hops, self._params.update_ns
        if self._places is None:
            return True
        if update_ns is None or hops.now_ns < self._updated_ns + update_ns:
            return False
        return (hops.positions(hops.now_ns) is not self._places
                or hops.obstacles.epoch != self._epoch)

    def _search(self, dest: int) -> dict[int, int]:
        """Each host's next hop. The graph has both directions, at the same cost."""
        before, _ = networkx.dijkstra_predecessor_and_distance(self._graph, dest)
        return {host: min(nearer) for host, nearer in before.items() if nearer}


def _graph(params: StaticParams, up: np.ndarray, one: np.ndarray, other: np.ndarray,
           delivery: np.ndarray) -> networkx.Graph:
    chance = np.zeros((len(up), len(up)))
    usable = (delivery >= params.usable) & up[one] & up[other]
    chance[one[usable], other[usable]] = delivery[usable]
    both = np.triu(chance * chance.T)
    graph = networkx.Graph()
    graph.add_nodes_from(range(len(up)))
    for a, b in np.argwhere(both).tolist():
        graph.add_edge(a, b, weight=1.0 if params.metric == "hops" else 1 / float(both[a, b]))
    return graph
