"""A host's router: it exchanges link states and declarations with others, and forwards messages."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

from desim.middleware.zenoh.link import SERVICE, RouterLink
from desim.middleware.zenoh.link_queue import Parcel
from desim.middleware.zenoh.registry import Declaration, DeclarationRegistry, Part
from desim.middleware.zenoh.sizes import (
    DECLARATIONS_BYTES,
    IDENTITY_BYTES,
    LOCATOR_BYTES,
    NEIGHBOUR_BYTES,
    STATE_BYTES,
    STATES_BYTES,
    STUB_BYTES,
)
from desim.middleware.zenoh.topology import LinkState, Topology, bits

if TYPE_CHECKING:
    from desim.middleware.message import Message
    from desim.middleware.tcp import Connection, Tcp
    from desim.middleware.zenoh.discovery import Finder
    from desim.middleware.zenoh.parameters import ZenohParams
    from desim.middleware.zenoh.publication import ZenohPublication
    from desim.ports.middleware import MiddlewareContext
    from desim.ports.networks import Handle

_NO_WAY = -1  # in place of a neighbour


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


class ZenohRouter:
    """A router from its host's start to its stop, which is its ``life``. Nodes declare as soon as
    the router has opened.

    Link states are flooded: each router passes new ones to its neighbours. Declarations of a router
    go along its tree of shortest ways, some time after the topology has changed. A router without a
    way to it is offline, and its declarations do not count.
    """

    def __init__(self, host: int, life: int, context: MiddlewareContext, params: ZenohParams,
                 tcp: Tcp, finder: Finder) -> None:
        self.host, self.life = host, life
        self.context, self.params, self.tcp = context, params, tcp
        self.constants = params.constants
        self.links: dict[int, RouterLink] = {}  # open ones, by peer
        self.topology = Topology(host, len(context.hosts), life)
        self.finder = finder
        self.registry = DeclarationRegistry(host, life, context)
        self._most_hops = len(context.hosts)
        self._online = 1 << host  # as bits
        self._news: dict[int, LinkStateNews] = {}  # by router
        self._free_ns = 0  # when it has passed on what it was busy with
        self._ends: dict[RouterLink, None] = {}  # opening ones too
        self._held_back: list[list[Declaration]] = []  # of nodes, until it opens
        self._opened = False
        self._timers: dict[Callable[[], object], Handle] = {}
        self._book(self._open, self.constants.open_wait_ns)
        if finder.listens:
            tcp.listen(host, SERVICE, self._called)
        finder.begin(self)

    def stop(self) -> None:
        """The host has stopped."""
        self.finder.stop()
        for timer in self._timers.values():
            timer.cancel()
        for link in self._ends:
            link.vanish("link_closed")

    # Links.

    def has_link(self, peer: int | None = None, life: int | None = None) -> bool:
        """Whether there is a link to ``peer`` in that life of it, or one is opening."""
        return any(peer in (None, link.peer) and (life is None or link.life in (0, life))
                   for link in self._ends)

    def dial(self, peer: int) -> None:
        link = RouterLink(self, peer)
        self._ends[link] = None
        link.dial()

    def welcomes(self, link: RouterLink) -> bool:
        """Whether the peer has no other link that it opened in the same life (zenoh: one inbound
        link of a transport)."""
        return not any(other.up and not other.expired and other.life == link.life
                       and other.connection.client == link.peer for other in self._beside(link))

    def linked(self, link: RouterLink) -> None:
        """``link`` has opened. If two routers dialled each other, the second link is a spare. A
        link beside one that has expired ends with it."""
        peer = link.peer
        others = [other for other in self._beside(link) if other.up]
        link.unread = any(other.expired for other in others)
        spare = not link.unread and any(other.life == link.life for other in others)
        if spare:
            # Nothing that has gone over the first link has to go over this one.
            link.named, link.declared = self.links[peer].named, self.links[peer].declared
            return
        self.links[peer] = link
        if link.unread:
            return
        for other in others:
            other.close()
        self.registry.begins(peer, link.life)
        self._relink(peer, True)
        self._send_all_states(link)
        self._topology_changed()
        self.finder.linked(peer)

    def unlinked(self, link: RouterLink) -> None:
        """``link`` is over."""
        del self._ends[link]
        if link.expired:
            self.part(link.peer)
        spare = next((other for other in self._beside(link) if other.up), None)
        if self.links.get(link.peer) is link and spare is not None:
            self.links[link.peer] = spare
        elif self.links.get(link.peer) is link:
            del self.links[link.peer]
            self._relink(link.peer, False)
            self._topology_changed()
        self.finder.unlinked(link.peer, link.up)

    def part(self, peer: int) -> None:
        """Close all links with ``peer``."""
        for link in [link for link in self._ends if link.peer == peer]:
            link.close()

    def _beside(self, link: RouterLink) -> list[RouterLink]:
        """The other links with the same peer."""
        return [other for other in self._ends if other.peer == link.peer and other is not link]

    def _called(self, connection: Connection) -> None:
        link = RouterLink(self, connection.client)
        self._ends[link] = None
        link.accept(connection)

    # Link states.

    def receive_states(self, link: RouterLink, states: dict[int, LinkState]) -> None:
        known = self.topology.states
        news = False
        for router in [router for router, state in states.items()
                       if known.get(router) is not state]:
            before, state = known.get(router), states[router]
            if self.topology.learn(router, state):
                self._pass_on(router, before, state, link.peer)
                news = True
        if news:
            self._topology_changed()

    def _relink(self, peer: int, up: bool) -> None:
        """An own link has opened or closed."""
        topology, own = self.topology, self.host
        before = topology.states[own]
        topology.link(peer, up)
        self._pass_on(own, before, topology.states[own], own)

    def _pass_on(self, router: int, before: LinkState | None, state: LinkState,
                 source: int) -> None:
        """Pass a router's link state on with the next flood, but not to ``source`` and the router
        itself, which know it. ``before`` is the earlier state (None: unknown; zenoh network.rs then
        sends all changes). Each change is a message of its own."""
        if before is None or before.life < state.life:
            self.registry.begins(router, state.life)
            self._news[router] = LinkStateNews(state, state.serial - 1,
                                      state.named - state.links.bit_count())
            return
        if router not in self._news:
            self._news[router] = LinkStateNews(state, before.serial, before.named)
        self._news[router].add(before, state, {router: None, source: None})

    def _topology_changed(self) -> None:
        self._book(self._flood, max(self._free_ns - self.context.now_ns, 0))
        self._book(self._spread_all, self.constants.trees_ns)
        self._review()

    def _book(self, what: Callable[[], object], delay_ns: int) -> None:
        """Call ``what`` once after a delay, no matter how often it is booked meanwhile."""
        if what not in self._timers:
            self._timers[what] = self.context.at(self.context.now_ns + delay_ns, self.host,
                                                 self._run_timer, what)

    def _run_timer(self, what: Callable[[], object]) -> None:
        del self._timers[what]
        what()

    def _flood(self) -> None:
        """Pass the news on, each change as a message of its own. Other messages wait while that
        takes time (zenoh: the lock of its tables)."""
        news, self._news = self._news, {}
        near = 1 << self.host | self.topology.states[self.host].links
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
        for peer, link in self.links.items():
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
        self._free_ns = self.context.now_ns + messages * self.constants.flood_ns

    def _send_all_states(self, link: RouterLink) -> None:
        """Send all link states over a new link, in one message."""
        states = dict(self.topology.states)
        link.fresh = {router: states[router] for router in self._news}
        for item in self._news.values():
            item.known.pop(link.peer, None)
        near = 1 << self.host | self.topology.states[self.host].links
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
                  lambda link, states: link.router.receive_states(link, states), states, writes)

    def _review(self) -> None:
        """Find the routers that are online now."""
        before, self._online = self._online, self.topology.online()
        for router in bits(before & ~self._online):
            self.registry.went_offline(router)
            for link in self.links.values():
                link.declared.pop(router, None)
        for router in bits(self._online & ~before):
            self.registry.came_online(router)
            self.finder.gossiped(router)

    # Declarations.

    def receive_declarations(self, link: RouterLink, parts: list[Part]) -> None:
        for part in parts:
            there = part.life, part.first + len(part.declarations)
            link.declared[part.router] = max(link.declared.get(part.router, there), there)
            self.registry.learn(part)
        self.spread([part.router for part in parts])

    def _open(self) -> None:
        """Send the first declaration, which wakes the writing task, and then the others together.
        """
        self._opened = True
        for together in (self._held_back[:1], self._held_back[1:]):
            for declarations in together:
                self.registry.declare(declarations)
            self.spread([self.host], len(together))

    def declare(self, declarations: list[Declaration]) -> None:
        """Declare for a node of the own host, in a message of its own."""
        if self._opened:
            self.registry.declare(declarations)
            self.spread([self.host])
        else:
            self._held_back.append(declarations)

    def _spread_all(self) -> None:
        self.spread(list(self.topology.reached()))

    def spread(self, routers: list[int], batches: int = 1) -> None:
        """Send declarations of these routers to the neighbours that get them from here, as far as
        they lack them; to each neighbour in ``batches`` messages."""
        missing: dict[int, list[Part]] = {}
        for router in routers:
            for child in self.topology.children(router):
                link = self.links[child]
                part = self.registry.beyond(router, link.declared.get(router, (0, 0)))
                if part is not None:
                    link.declared[router] = part.life, part.first + len(part.declarations)
                    missing.setdefault(child, []).append(part)
        for child, parts in missing.items():
            size_bytes = batches * DECLARATIONS_BYTES + sum(
                declaration.size_bytes for part in parts for declaration in part.declarations)
            self.links[child].send(
                "declare", size_bytes,
                lambda link, parts: link.router.receive_declarations(link, parts), parts, batches)

    # Messages.

    def forward(self, message: Message, publication: ZenohPublication, to: Sequence[int],
                first_ns: int, last_ns: int, hops: int) -> None:
        """Send one copy to each neighbour on the way from the publisher to hosts in ``to``. The
        message has passed ``hops`` links, on which its first and last frame left at these instants
        (-1: none did)."""
        ways = self.topology.hops(publication.source)
        if len(to) == 1 and hops < self._most_hops:  # as nearly always
            link = self.links.get(ways.get(to[0], _NO_WAY))
            if link is not None:
                link.line.offer(Parcel(message, publication, (to[0],), first_ns, last_ns,
                                       hops + 1))
                return
        groups: dict[int, list[int]] = {}
        for receiver in to:
            groups.setdefault(ways.get(receiver, _NO_WAY), []).append(receiver)
        for neighbour, group in groups.items():
            link = self.links.get(neighbour)
            if link is not None and hops < self._most_hops:
                link.line.offer(Parcel(message, publication, tuple(group), first_ns, last_ns,
                                       hops + 1))
            else:
                for receiver in group:
                    publication.lost(message, receiver, "no_route", first_ns, last_ns)

    def received(self, parcel: Parcel) -> None:
        to, own = parcel.to, self.host
        parcel.gone = True
        if own in to:
            parcel.publication.arrived(parcel, own)
            if len(to) == 1:
                return
            to = tuple(receiver for receiver in to if receiver != own)
        if to:
            self.context.relay(parcel.message, own)
            self.forward(parcel.message, parcel.publication, to, parcel.first_ns, parcel.last_ns,
                         parcel.hops)

    def discard(self, publication: ZenohPublication, reason: str) -> None:
        """A publisher of its host is gone, and its waiting messages with it."""
        for link in self.links.values():
            for parcel in link.line.parcels():
                if parcel.publication is publication:
                    parcel.drop(reason)


def _changes_bytes(changes: int, named: int, near: int) -> int:
    """The bytes of ``changes`` changes that name ``named`` routers, each change in a message of its
    own; ``near`` 1: with the address."""
    return (changes * (STATES_BYTES + STATE_BYTES + near * LOCATOR_BYTES)
            + named * NEIGHBOUR_BYTES)
