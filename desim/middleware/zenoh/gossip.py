"""Peers: each links to all others, passes on where they are, and forwards nothing for them.

As measured of zenoh 1.10.2, whose sources call this ``p2p_peer`` (gossip without multihop).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from desim.middleware.zenoh.sizes import (
    IDENTITY_BYTES,
    INTEREST_BYTES,
    LOCATOR_BYTES,
    STATE_BYTES,
    STATES_BYTES,
    STUB_BYTES,
)

if TYPE_CHECKING:
    from desim.middleware.zenoh.link import RouterLink
    from desim.middleware.zenoh.router import ZenohRouter

_KNOWN_BYTES = STATE_BYTES + IDENTITY_BYTES + LOCATOR_BYTES


class DirectLinks:
    """The links of a peer. It uses no others: what has no link with it is out of its reach."""

    def __init__(self, own: int) -> None:
        self._own = own
        self._linked: dict[int, int] = {}  # peer to peer

    def link(self, peer: int, up: bool) -> None:
        """An own link has opened or closed."""
        if up:
            self._linked[peer] = peer
        else:
            del self._linked[peer]

    def reached(self) -> list[int]:
        """The peers with a link, after the own one."""
        return [self._own, *self._linked]

    def online(self) -> int:
        """The same peers, as bits."""
        return sum(1 << peer for peer in self.reached())

    def hops(self, root: int) -> dict[int, int]:
        """The neighbours to which messages of ``root`` go, by destination: only the own ones."""
        return self._linked if root == self._own else {}

    def children(self, root: int) -> list[int]:
        """The neighbours that get declarations of ``root`` from here."""
        return list(self.hops(root))


class Gossip:
    """The peers that ``router``, a peer, announces to others: over a new link all those that it
    has a link with, and over its other links the new one, once it knows where that is."""

    def __init__(self, router: ZenohRouter) -> None:
        self._router = router
        self.topology = DirectLinks(router.host)
        self._located: dict[int, None] = {}  # peers that have said where they are

    def link(self, peer: int, up: bool) -> None:
        """An own link has opened or closed."""
        self.topology.link(peer, up)
        if not up:
            self._located.pop(peer, None)

    def changed(self) -> None:
        """Declare to new neighbours."""
        self._router.spread_all()

    def greet(self, link: RouterLink) -> None:
        """Send over a new link where this peer is, and those that it knows."""
        stubs = len(self._router.links) - len(self._located)  # that have not said it
        link.send("gossip", STATES_BYTES + (1 + len(self._located)) * _KNOWN_BYTES
                  + stubs * STUB_BYTES + INTEREST_BYTES,
                  lambda link, others: _of(link).located(link, others), [*self._located])

    def located(self, link: RouterLink, others: list[int]) -> None:
        """The peer of ``link`` has said where it is, and where ``others`` are."""
        router, peer = self._router, link.peer
        if peer in router.links and peer not in self._located:
            self._located[peer] = None
            for other, way in router.links.items():
                if other != peer:
                    way.send("gossip", STATES_BYTES + _KNOWN_BYTES,
                             lambda link, others: _of(link).heard(others), [peer])
        self.heard(others)

    def heard(self, others: list[int]) -> None:
        """Take the gossip where ``others`` are."""
        for other in others:
            self._router.finder.gossiped(other)


def _of(link: RouterLink) -> Gossip:
    network = link.router.network
    assert isinstance(network, Gossip)
    return network
