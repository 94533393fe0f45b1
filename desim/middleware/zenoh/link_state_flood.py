"""The link states of a router, which floods them: each router passes new ones to its neighbours."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from desim.middleware.zenoh.sizes import (
    IDENTITY_BYTES,
    LOCATOR_BYTES,
    NEIGHBOUR_BYTES,
    STATE_BYTES,
    STATES_BYTES,
    STUB_BYTES,
)
from desim.middleware.zenoh.topology import LinkState, Topology

if TYPE_CHECKING:
    from desim.middleware.zenoh.link import RouterLink
    from desim.middleware.zenoh.router import ZenohRouter


class LinkStateNews:
    """The changes of a router's link state that are to be passed on. ``state``: the present one.
    Before it, the router had changed ``serial`` times and named ``named`` routers. ``known``: by
    peer, the number of changes that it knows already, and of the names in these."""

    def __init__(self, state: LinkState, serial: int, named: int) -> None:
        self.state, self.serial, self.named = state, serial, named
        self.known: dict[int, tuple[int, int]] = {}

    def add(self, before: LinkState, state: LinkState, knowing: Iterable[int]) -> None:
        """The state changed from ``before`` to ``state``; the routers ``knowing`` know that."""
        self.state = state
        for peer in knowing:
            changes, named = self.known.get(peer, (0, 0))
            self.known[peer] = (changes + state.serial - before.serial,
                                named + state.named - before.named)

    def until(self, state: LinkState) -> tuple[int, int]:
        """The number of changes up to ``state``, and of the names in these."""
        if state.serial <= self.serial or state.life < self.state.life:
            return 0, 0
        return state.serial - self.serial, state.named - self.named


class LinkStateFlood:
    """The links of all routers, as ``router`` knows them and announces changes."""

    def __init__(self, router: ZenohRouter) -> None:
        self._router, self._own = router, router.host
        self.topology = Topology(router.host, len(router.context.hosts), router.life)
        self._news: dict[int, LinkStateNews] = {}  # by router
        self._free_ns = 0  # when it has passed on what it was busy with

    def changed(self) -> None:
        """The topology is another one: pass the news on."""
        router = self._router
        router.book(self.flood, max(self._free_ns - router.context.now_ns, 0))
        router.book(router.spread_all, router.constants.trees_ns)

    def link(self, peer: int, up: bool) -> None:
        """An own link has opened or closed."""
        topology, own = self.topology, self._own
        before = topology.states[own]
        topology.link(peer, up)
        self._pass_on(own, before, topology.states[own], own)

    def receive(self, link: RouterLink, states: dict[int, LinkState]) -> None:
        """Link states have come over ``link``."""
        known = self.topology.states
        news = False
        for router in [router for router, state in states.items()
                       if known.get(router) is not state]:
            before, state = known.get(router), states[router]
            if self.topology.learn(router, state):
                self._pass_on(router, before, state, link.peer)
                news = True
        if news:
            self._router.topology_changed()

    def _pass_on(self, router: int, before: LinkState | None, state: LinkState,
                 source: int) -> None:
        """Pass a router's link state on with the next flood, but not to ``source`` and the router
        itself, which know it. ``before`` is the earlier state (None: unknown; zenoh network.rs then
        sends all changes). Each change is a message of its own."""
        if before is None or before.life < state.life:
            self._router.registry.begins(router, state.life)
            self._news[router] = LinkStateNews(state, state.serial - 1,
                                      state.named - state.links.bit_count())
            return
        if router not in self._news:
            self._news[router] = LinkStateNews(state, before.serial, before.named)
        self._news[router].add(before, state, {router: None, source: None})

    def flood(self) -> None:
        """Pass the news on, each change as a message of its own. Other messages wait while that
        takes time (zenoh: the lock of its tables)."""
        news, self._news = self._news, {}
        near = 1 << self._own | self.topology.states[self._own].links
        states: dict[int, LinkState] = {}
        known: dict[int, list[tuple[int, int]]] = {}  # by peer: changes and their bytes
        changes = size_bytes = named = 0
        for router, item in news.items():
            states[router] = state = item.state
            named |= state.links
            more = item.until(state)
            changes += more[0]
            size_bytes += _changes_bytes(*more, near >> router & 1)
            for peer, less in item.known.items():
                known.setdefault(peer, []).append(
                    (less[0], _changes_bytes(*less, near >> router & 1)))
        messages = 0
        for peer, link in self._router.links.items():
            left, left_bytes = changes, size_bytes
            for count, count_bytes in known.get(peer, ()):
                left -= count
                left_bytes -= count_bytes
            for router, state in link.fresh.items():
                count, names = news[router].until(state)
                left -= count
                left_bytes -= _changes_bytes(count, names, near >> router & 1)
            link.fresh = {}
            if left:
                messages += left
                self._send_states(link, states, left_bytes, left, named)
        self._free_ns = self._router.context.now_ns + messages * self._router.constants.flood_ns

    def greet(self, link: RouterLink) -> None:
        """Send all link states over a new link, in one message."""
        states = dict(self.topology.states)
        link.fresh = {router: states[router] for router in self._news}
        for item in self._news.values():
            item.known.pop(link.peer, None)
        near = 1 << self._own | self.topology.states[self._own].links
        size_bytes, named = STATES_BYTES, 0
        for router, state in states.items():
            named |= state.links
            size_bytes += (STATE_BYTES + LOCATOR_BYTES * (near >> router & 1)
                           + NEIGHBOUR_BYTES * state.links.bit_count())
        self._send_states(link, states, size_bytes, 1, named)

    def _send_states(self, link: RouterLink, states: dict[int, LinkState], size_bytes: int,
                     writes: int, named: int) -> None:
        """Send ``states`` of ``size_bytes``. With them go those identities of routers among them
        and their neighbours (``named``) that have not gone over the link yet."""
        routers = 0
        for router in states:
            routers |= 1 << router
        identities = (routers & ~link.named).bit_count()
        stubs = named & ~(routers | link.named)
        link.named |= routers | stubs
        link.send("linkstate",
                  size_bytes + IDENTITY_BYTES * identities + STUB_BYTES * stubs.bit_count(),
                  _received, states, writes)


def _received(link: RouterLink, states: dict[int, LinkState]) -> None:
    network = link.router.network
    assert isinstance(network, LinkStateFlood)
    network.receive(link, states)


def _changes_bytes(changes: int, named: int, near: int) -> int:
    """The bytes of ``changes`` changes that name ``named`` routers, each change in a message of its
    own; ``near`` 1: with the address."""
    return (changes * (STATES_BYTES + STATE_BYTES + near * LOCATOR_BYTES)
            + named * NEIGHBOUR_BYTES)
