"""A host's router: what it has learnt from the others, what it tells them, and how it passes
messages on."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

from desim.middleware.zenoh.line import Parcel
from desim.middleware.zenoh.link import SERVICE, Link
from desim.middleware.zenoh.registry import Declaration, Part, Registry
from desim.middleware.zenoh.sizes import (
    DECLARATIONS_BYTES,
    IDENTITY_BYTES,
    LOCATOR_BYTES,
    NEIGHBOUR_BYTES,
    STATE_BYTES,
    STATES_BYTES,
    STUB_BYTES,
)
from desim.middleware.zenoh.topology import State, Topology, bits

if TYPE_CHECKING:
    from desim.middleware.tcp import Connection, Tcp
    from desim.middleware.topics import Message
    from desim.middleware.zenoh.finder import Finder
    from desim.middleware.zenoh.parameters import ZenohParams
    from desim.middleware.zenoh.publication import Publication
    from desim.ports.middleware import MiddlewareContext


class News:
    """How a router's link state has changed, to be passed on: it is ``state`` now; before, it had
    changed ``serial`` times and named ``named`` routers. ``known``: to whom so many of the changes,
    with so many names, need not be told."""

    __slots__ = ("state", "serial", "named", "known")

    def __init__(self, state: State, serial: int, named: int) -> None:
        self.state, self.serial, self.named = state, serial, named
        self.known: dict[int, tuple[int, int]] = {}

    def add(self, before: State, state: State, knowing: Iterable[int]) -> None:
        """It was ``before``, and is ``state``, as those ``knowing`` know."""
        self.state = state
        for peer in knowing:
            changes, named = self.known.get(peer, (0, 0))
            self.known[peer] = (changes + state.serial - before.serial,
                                named + state.named - before.named)

    def until(self, state: State) -> tuple[int, int]:
        """How many changes it had until it was ``state``, and how many they named."""
        if state.serial <= self.serial or state.life < self.state.life:
            return 0, 0
        return state.serial - self.serial, state.named - self.named


class Router:
    """From its host's start to its stop, which is its ``life``. Nodes declare as soon as it has
    opened.

    Link states are flooded: each router passes what is news to its neighbours. Declarations of a
    router go along its tree of shortest ways, some time after the topology has changed. What there
    is no way to any more is offline, and nothing that it declared counts.
    """

    __slots__ = ("host", "life", "context", "params", "tcp", "links", "topology", "finder",
                 "registry", "_most_hops", "_online", "_news", "_free_ns", "_ends", "_timers",
                 "_wishes")

    def __init__(self, host: int, life: int, context: MiddlewareContext, params: ZenohParams,
                 tcp: Tcp, finder: Finder) -> None:
        self.host, self.life = host, life
        self.context, self.params, self.tcp = context, params, tcp
        self.links: dict[int, Link] = {}  # open ones, by peer
        self.topology = Topology(host, len(context.hosts), life)
        self.finder = finder
        self.registry = Registry(host, life, context)
        self._most_hops = len(context.hosts)
        self._online = 1 << host  # as bits
        self._news: dict[int, News] = {}  # by router
        self._free_ns = 0  # when it has passed on what it was busy with
        self._ends: dict[Link, None] = {}  # opening ones too
        self._wishes: list[list[Declaration]] | None = []  # of nodes, until it opens
        self._timers: dict[Callable[[], Any], Any] = {}
        self._book(self._open, params.open_wait_ns)
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
        """Whether there is one, or one is opening: to ``peer``, in that life of it."""
        return any(peer in (None, link.peer) and (life is None or link.life in (0, life))
                   for link in self._ends)

    def dial(self, peer: int) -> None:
        link = Link(self, peer)
        self._ends[link] = None
        link.dial()

    def welcomes(self, link: Link) -> bool:
        """Not who has called before, in the same life (zenoh: one inbound link of a transport)."""
        return not any(other.up and not other.expired and other.life == link.life
                       and other.connection.client == link.peer for other in self._beside(link))

    def linked(self, link: Link) -> None:
        """It is open. Of two that called each other the second link is a spare. Beside one that
        has expired and waits for its end, it shares this end."""
        peer = link.peer
        others = [other for other in self._beside(link) if other.up]
        link.unread = any(other.expired for other in others)
        spare = not link.unread and any(other.life == link.life for other in others)
        if spare:
            link.shares(self.links[peer])
            return
        self.links[peer] = link
        if link.unread:
            return
        for other in others:
            other.close()
        self.registry.begins(peer, link.life)
        self._relink(peer, True)
        self._tell_all(link)
        self._topology_changed()
        self.finder.linked(peer)

    def unlinked(self, link: Link) -> None:
        """It is over."""
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
        """Close all links with it."""
        for link in [link for link in self._ends if link.peer == peer]:
            link.close()

    def _beside(self, link: Link) -> list[Link]:
        """Others with the same peer."""
        return [other for other in self._ends if other.peer == link.peer and other is not link]

    def _called(self, connection: Connection) -> None:
        link = Link(self, connection.client)
        self._ends[link] = None
        link.accept(connection)

    # Who is linked to whom.

    def hear_states(self, link: Link, states: dict[int, State]) -> None:
        known = self.topology.states
        heard = [router for router, state in states.items() if known.get(router) is not state]
        news = False
        for router in heard:
            before, state = known.get(router), states[router]
            if self.topology.learn(router, state):
                self._pass_on(router, before, state, link.peer)
                news = True
        if news:
            self._topology_changed()

    def _relink(self, peer: int, up: bool) -> None:
        """An own link has come up or gone."""
        topology, own = self.topology, self.host
        before = topology.states[own]
        topology.link(peer, up)
        self._pass_on(own, before, topology.states[own], own)

    def _pass_on(self, router: int, before: State | None, state: State, source: int) -> None:
        """With the next flood to all who do not know it, ``source`` and the router itself: its link
        state, which was ``before`` (None: unknown; zenoh network.rs tells all of such a one). It
        was said by itself each time that it changed."""
        if before is None or before.life < state.life:
            self.registry.begins(router, state.life)
            self._news[router] = News(state, state.serial - 1,
                                      state.named - state.links.bit_count())
            return
        if router not in self._news:
            self._news[router] = News(state, before.serial, before.named)
        self._news[router].add(before, state, {router: None, source: None})

    def _topology_changed(self) -> None:
        self._book(self._flood, max(self._free_ns - self.context.now_ns, 0))
        self._book(self._spread_all, self.params.trees_ns)
        self._review()

    def _book(self, what: Callable[[], Any], delay_ns: int) -> None:
        """Once, however often it is asked for meanwhile."""
        if what not in self._timers:
            self._timers[what] = self.context.at(self.context.now_ns + delay_ns, self.host,
                                                 self._due, what)

    def _due(self, what: Callable[[], Any]) -> None:
        del self._timers[what]
        what()

    def _flood(self) -> None:
        """Pass the news on, each change as a message of its own. That takes time, and what is heard
        meanwhile has to wait (zenoh: the lock of its tables)."""
        news, self._news = self._news, {}
        near = 1 << self.host | self.topology.states[self.host].links
        states: dict[int, State] = {}
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
            for less, less_bytes in known.get(peer, ()):
                left -= less
                left_bytes -= less_bytes
            for router, state in link.fresh.items():
                less, names = news[router].until(state)
                left -= less
                left_bytes -= _changes_bytes(less, names, near >> router & 1)
            link.fresh = {}
            if left:
                messages += left
                self._tell(link, states, left_bytes, left, named)
        self._free_ns = self.context.now_ns + messages * self.params.flood_ns

    def _tell_all(self, link: Link) -> None:
        """Over a new link: all link states in one message."""
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
        self._tell(link, states, size_bytes, 1, named)

    def _tell(self, link: Link, states: dict[int, State], size_bytes: int, writes: int,
              named: int) -> None:
        """``size_bytes`` without the identities of those among ``states`` and their neighbours
        (``named``) that the link has not seen yet."""
        routers = 0
        for router in states:
            routers |= 1 << router
        identities = (routers & ~link.named).bit_count()
        stubs = named & ~(routers | link.named)
        link.named |= routers | stubs
        link.say("linkstate", size_bytes + IDENTITY_BYTES * identities
                 + STUB_BYTES * stubs.bit_count(), _states_came, states, writes)

    def _review(self) -> None:
        """Who is online now."""
        before, self._online = self._online, self.topology.online()
        for router in bits(before & ~self._online):
            self.registry.goes(router)
            for link in self.links.values():
                link.told.pop(router, None)
        for router in bits(self._online & ~before):
            self.registry.comes(router)
            self.finder.heard_of(router)

    # Who has declared what.

    def hear_declared(self, link: Link, parts: list[Part]) -> None:
        for part in parts:
            there = part.life, part.first + len(part.declarations)
            link.told[part.router] = max(link.told.get(part.router, there), there)
            self.registry.learn(part)
        self.spread([part.router for part in parts])

    def _open(self) -> None:
        """The first wish wakes who writes, and what has come meanwhile goes together."""
        wishes, self._wishes = self._wishes, None
        for together in (wishes[:1], wishes[1:]):
            for declarations in together:
                self.registry.declare(declarations)
            self.spread([self.host], len(together))

    def declare(self, declarations: list[Declaration]) -> None:
        """What a node of its own host wants known. Each wish is a message of its own."""
        if self._wishes is not None:
            self._wishes.append(declarations)
        else:
            self.registry.declare(declarations)
            self.spread([self.host])

    def _spread_all(self) -> None:
        self.spread(list(self.topology.reached()))

    def spread(self, routers: list[int], wishes: int = 1) -> None:
        """Tell the neighbours what these have declared, those whom it reaches through here, and
        only what they were not told yet; so many ``wishes``, each a message of its own."""
        told: dict[int, list[Part]] = {}
        for router in routers:
            for child in self.topology.children(router):
                link = self.links[child]
                part = self.registry.beyond(router, link.told.get(router, (0, 0)))
                if part is not None:
                    link.told[router] = part.life, part.first + len(part.declarations)
                    told.setdefault(child, []).append(part)
        for child, parts in told.items():
            size_bytes = wishes * DECLARATIONS_BYTES + sum(
                declaration.size_bytes for part in parts for declaration in part.declarations)
            self.links[child].say("declare", size_bytes, _declared_came, parts, wishes)

    # Messages.

    def forward(self, message: Message, publication: Publication, to: Sequence[int],
                first_ns: int, last_ns: int, hops: int) -> None:
        """One copy to each neighbour that is on the way from the publisher to some of ``to``, after
        ``hops`` links on which its first and last frame left at these instants (-1: none did)."""
        ways = self.topology.hops(publication.source)
        if len(to) == 1 and hops < self._most_hops:  # as nearly always
            link = self.links.get(ways.get(to[0]))
            if link is not None:
                link.line.offer(Parcel(message, publication, (to[0],), first_ns, last_ns,
                                       hops + 1))
                return
        groups: dict[int | None, list[int]] = {}
        for receiver in to:
            groups.setdefault(ways.get(receiver), []).append(receiver)
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
            self.forward(parcel.message, parcel.publication, to, parcel.first_ns, parcel.last_ns,
                         parcel.hops)

    def discard(self, publication: Publication, reason: str) -> None:
        """A publisher of its host is gone, and what waits with it."""
        for link in self.links.values():
            for parcel in link.line.parcels():
                if parcel.publication is publication:
                    parcel.drop(reason)


def _changes_bytes(changes: int, named: int, near: int) -> int:
    """Of so many changes that name so many routers, each in a message of its own; ``near`` 1: with
    the address."""
    return (changes * (STATES_BYTES + STATE_BYTES + near * LOCATOR_BYTES)
            + named * NEIGHBOUR_BYTES)


def _states_came(link: Link, states: dict[int, State]) -> None:
    link.router.hear_states(link, states)


def _declared_came(link: Link, parts: list[Part]) -> None:
    link.router.hear_declared(link, parts)
