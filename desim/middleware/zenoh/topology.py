"""The links between routers, as one of them knows them, and the ways over them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple


class LinkState(NamedTuple):
    """A router's link state: the life in which it announced it, the number of the announcement, its
    neighbours as bits, and the number of routers that it has named in all its announcements."""

    life: int
    serial: int
    links: int
    named: int


def bits(mask: int) -> Iterator[int]:
    """The positions of the ones in ``mask``, ascending."""
    while mask:
        low = mask & -mask
        yield low.bit_length() - 1
        mask ^= low


@lru_cache(maxsize=1 << 10)
def tree(edges: tuple[int, ...], root: int) -> dict[int, int]:
    """The parent of each router that can be reached from ``root``, on a shortest path; of several
    the parent with the lowest index. ``edges``: each router's neighbours as bits."""
    parents = {root: root}
    layer, seen = [root], 1 << root
    while layer:
        following = []
        for router in layer:
            fresh = edges[router] & ~seen
            seen |= fresh
            for other in bits(fresh):
                parents[other] = router
                following.append(other)
        layer = sorted(following)
    return parents


@lru_cache(maxsize=1 << 10)
def next_hops(edges: tuple[int, ...], root: int, own: int) -> dict[int, int]:
    """The neighbours to which router ``own`` forwards messages of ``root``, by destination: those
    behind it in the tree of ``root``."""
    parents = tree(edges, root)
    hops = {}
    for destination in parents:
        hop = destination
        while hop != root and parents[hop] != own:
            hop = parents[hop]
        if hop != root:
            hops[destination] = hop
    return hops


class Topology:
    """All link states that router ``own`` of ``routers`` has received. None is ever forgotten: a
    link counts only while both of its ends announce it. Own links count at once."""

    def __init__(self, own: int, routers: int, life: int) -> None:
        self.own = own
        self.states = {own: LinkState(life, 0, 0, 0)}
        self._announced = [0] * routers  # each one's neighbours, as it announces them
        self._linked = [0] * routers  # as both ends announce them
        self._edges: tuple[int, ...] | None = None
        self._hops: dict[int, dict[int, int]] = {}  # by root, until the links change

    def link(self, peer: int, up: bool) -> None:
        """An own link has opened or closed."""
        life, serial, links, named = self.states[self.own]
        links = links | 1 << peer if up else links & ~(1 << peer)
        self._take(self.own, LinkState(life, serial + 1, links, named + links.bit_count()))

    def learn(self, router: int, state: LinkState) -> bool:
        """Take a link state. Returns whether it is newer than the known one."""
        known = self.states.get(router)
        if router == self.own or known is not None and known[:2] >= state[:2]:
            return False
        self._take(router, state)
        return True

    @property
    def edges(self) -> tuple[int, ...]:
        """Each router's neighbours as bits."""
        if self._edges is None:
            self._edges = tuple(self._linked)
        return self._edges

    def reached(self) -> dict[int, int]:
        """The routers to which there is a path, with the own one, nearest first."""
        return tree(self.edges, self.own)

    def online(self) -> int:
        """The same routers, as bits."""
        edges = self._linked
        seen = found = 1 << self.own
        while found:
            near = 0
            for router in bits(found):
                near |= edges[router]
            found = near & ~seen
            seen |= found
        return seen

    def hops(self, root: int) -> dict[int, int]:
        """``next_hops`` from the own router."""
        hops = self._hops.get(root)
        if hops is None:
            hops = self._hops[root] = next_hops(self.edges, root, self.own)
        return hops

    def children(self, root: int) -> list[int]:
        """The neighbours that get messages of ``root`` from the own router."""
        own = self.own
        return [router for router, parent in tree(self.edges, root).items()
                if parent == own and router != own]

    def _take(self, router: int, state: LinkState) -> None:
        self.states[router] = state
        announced, linked, own = self._announced, self._linked, self.own
        changed = announced[router] ^ state.links
        announced[router] = state.links
        bit = 1 << router
        for other in bits(changed):
            if own in (router, other):
                up = announced[own] >> (other if own == router else router) & 1
            else:
                up = announced[router] >> other & announced[other] >> router & 1
            if up:
                linked[router] |= 1 << other
                linked[other] |= bit
            else:
                linked[router] &= ~(1 << other)
                linked[other] &= ~bit
        if changed:
            self._edges = None
            self._hops.clear()
