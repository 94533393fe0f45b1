"""A host's router: what it has learnt from the others, what it tells them, and how it passes
messages on."""

from __future__ import annotations

from bisect import insort
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from desim.middleware.zenoh.line import Parcel
from desim.middleware.zenoh.link import SERVICE, Link
from desim.middleware.zenoh.sizes import (
    DECLARATIONS_BYTES,
    IDENTITY_BYTES,
    LOCATOR_BYTES,
    NEIGHBOUR_BYTES,
    STATE_BYTES,
    STATES_BYTES,
    STUB_BYTES,
)
from desim.middleware.zenoh.topology import State, Topology

if TYPE_CHECKING:
    from desim.middleware.context import Context
    from desim.middleware.tcp import Connection, Tcp
    from desim.middleware.topics import Message
    from desim.middleware.zenoh.finder import Finder
    from desim.middleware.zenoh.params import ZenohParams
    from desim.middleware.zenoh.publication import Publication


class Declaration(NamedTuple):
    """Of a subscriber, with the topic that it listens to, or of a liveliness token (no topic)."""

    size_bytes: int
    topic: str | None


# Of a router: in which life it declared them, in their order. Nothing is ever undeclared: in
# desim what a host has lasts until it stops.
Declared = tuple[int, list[Declaration]]
Part = tuple[int, int, int, list[Declaration]]  # router, its life, number of the first, and those


class Router:
    """From its host's start to its stop, which is its ``life``.

    Link states are flooded: each router passes what is news to its neighbours. Declarations of a
    router go along its tree of shortest ways, some time after the topology has changed. What there
    is no way to any more is offline, and nothing that it declared counts.
    """

    __slots__ = ("host", "life", "context", "params", "tcp", "links", "topology", "finder",
                 "_declared", "_online", "_published", "_listeners", "_news", "_ends", "_flooding",
                 "_spreading")

    def __init__(self, host: int, life: int, context: Context, params: ZenohParams, tcp: Tcp,
                 finder: Finder) -> None:
        self.host, self.life = host, life
        self.context, self.params, self.tcp = context, params, tcp
        self.links: dict[int, Link] = {}  # open ones, by peer
        self.topology = Topology(host, len(context.hosts), life)
        self.finder = finder
        self._declared: dict[int, Declared] = {host: (life, [])}
        self._online: dict[int, int] = {host: host}
        self._published: dict[str, None] = {}
        self._listeners: dict[str, list[int]] = {}  # of those online, ascending
        # Routers whose link state is to be passed on; True: to everybody, not to those only who do
        # not have it.
        self._news: dict[int, bool] = {}
        self._ends: dict[Link, None] = {}  # opening ones too
        self._flooding: Any = None
        self._spreading: Any = None
        if finder.listens:
            tcp.listen(host, SERVICE, self._called)
        finder.begin(self)

    def stop(self) -> None:
        """The host has stopped."""
        self.finder.stop()
        for timer in (self._flooding, self._spreading):
            if timer is not None:
                timer.cancel()
        for link in self._ends:
            link.vanish("link_closed")

    # Its own host.

    def publishes(self, topic: str) -> bool:
        """Its host publishes ``topic`` from now on. Whether that is new."""
        if topic in self._published:
            return False
        self._published[topic] = None
        for listener in self.listeners(topic):
            self._knows(listener, topic, True)
        return True

    def declare(self, declarations: list[Declaration]) -> None:
        """Of its host, beside what it has declared before."""
        if declarations:
            self._declared[self.host][1].extend(declarations)
            self._gain(self.host, declarations)
            self._spread([self.host])

    def listeners(self, topic: str) -> Sequence[int]:
        """Hosts that are known to listen to it now, ascending, its own among them."""
        return self._listeners.get(topic, ())

    # Links.

    def has_link(self, peer: int | None = None, life: int | None = None) -> bool:
        """Whether there is one, or one is opening: to ``peer``, in that life of it."""
        return any(peer in (None, link.peer) and (life is None or link.life in (0, life))
                   for link in self._ends)

    def dial(self, peer: int) -> None:
        link = Link(self, peer)
        self._ends[link] = None
        link.dial()

    def welcomes(self, peer: int) -> bool:
        """Of two that call each other the one of the higher index (zid) prevails."""
        mine = [link for link in self._ends if link.peer == peer and link.dialling]
        if mine and self.host > peer:
            return False
        for link in mine:
            link.close()
        return True

    def linked(self, link: Link) -> None:
        """It is open. Who calls anew has given up the old link."""
        peer = link.peer
        for other in [one for one in self._ends if one.peer == peer and one is not link]:
            other.close()
        self._begins(peer, link.life)
        self.links[peer] = link
        self.topology.link(peer, True)
        self._tell_states(link, self.topology.states)
        self._topology_changed({self.host: False})
        self.finder.linked(peer)

    def unlinked(self, link: Link) -> None:
        """It is over."""
        del self._ends[link]
        if self.links.get(link.peer) is link:
            del self.links[link.peer]
            self.topology.link(link.peer, False)
            self._topology_changed({self.host: False})
        self.finder.unlinked(link.peer, link.up)

    def _called(self, connection: Connection) -> None:
        link = Link(self, connection.client)
        self._ends[link] = None
        link.accept(connection)

    # Who is linked to whom.

    def hear_states(self, link: Link, states: dict[int, State]) -> None:
        for router, state in states.items():
            link.states[router] = state
        known = self.topology.states
        news = {router: router not in known for router in states}
        news = {router: new for router, new in news.items()
                if self.topology.learn(router, states[router])}
        if news:
            self._topology_changed(news)

    def _topology_changed(self, routers: dict[int, bool]) -> None:
        """The link states of ``routers`` are new; True: these were unknown (zenoh network.rs tells
        all neighbours of them, those who said so too)."""
        for router, new in routers.items():
            self._news[router] = new or self._news.get(router, False)
            self._begins(router, self.topology.states[router].life)
        context, params = self.context, self.params
        if self._flooding is None:
            self._flooding = context.at(context.now_ns + params.gather_ns, self.host, self._flood)
        if self._spreading is None:
            self._spreading = context.at(context.now_ns + params.trees_ns, self.host,
                                         self._spread_all)
        self._review()

    def _flood(self, _: Any) -> None:
        self._flooding = None
        news, self._news = self._news, {}
        states = self.topology.states
        for peer, link in self.links.items():
            unknown = {router: states[router] for router, new in news.items()
                       if new or router != peer and link.states.get(router) != states[router]}
            if unknown:
                self._tell_states(link, unknown)

    def _tell_states(self, link: Link, states: dict[int, State]) -> None:
        size_bytes, links = STATES_BYTES, 0
        for router, state in states.items():
            link.states[router] = state
            new = not link.named >> router & 1
            near = router == self.host or router in self.links
            size_bytes += (STATE_BYTES + new * IDENTITY_BYTES + near * LOCATOR_BYTES
                           + NEIGHBOUR_BYTES * state.links.bit_count())
            link.named |= 1 << router
            links |= state.links
        stubs = links & ~link.named
        link.named |= stubs
        size_bytes += stubs.bit_count() * STUB_BYTES
        link.say("linkstate", size_bytes, _states_came, dict(states))

    def _review(self) -> None:
        """Who is online now."""
        before, now = self._online, self.topology.reached()
        self._online = now
        for router in sorted(before):
            if router not in now:
                self.context.sees(self.host, router, "offline")
                self._lose(router, self._declared.get(router, (0, []))[1])
                for link in self.links.values():
                    link.told.pop(router, None)
        for router in sorted(now):
            if router not in before:
                self.context.sees(self.host, router, "online")
                self._gain(router, self._declared.get(router, (0, []))[1])
                self.finder.heard_of(router)

    # Who has declared what.

    def hear_declared(self, link: Link, parts: list[Part]) -> None:
        for router, life, first, declarations in parts:
            self._begins(router, life)
            known_life, known = self._declared.setdefault(router, (life, []))
            if known_life > life:
                continue
            fresh = declarations[len(known) - first:]
            known.extend(fresh)
            link.told[router] = life, len(known)
            if router in self._online:
                self._gain(router, fresh)
            self._spread([router])

    def _spread_all(self, _: Any) -> None:
        self._spreading = None
        self._spread([router for router in self._online if router in self._declared])

    def _spread(self, routers: list[int]) -> None:
        """Tell the neighbours what these have declared, those whom it reaches through here, and
        only what they were not told yet."""
        told: dict[int, list[Part]] = {}
        for router in routers:
            for child in self.topology.children(router):
                link = self.links[child]
                life, declarations = self._declared[router]
                told_life, told_first = link.told.get(router, (life, 0))
                first = told_first if told_life == life else 0
                if first < len(declarations):
                    link.told[router] = life, len(declarations)
                    told.setdefault(child, []).append((router, life, first, declarations[first:]))
        for child, parts in told.items():
            size_bytes = DECLARATIONS_BYTES + sum(
                declaration.size_bytes for part in parts for declaration in part[3])
            self.links[child].say("declare", size_bytes, _declared_came, parts)

    def _begins(self, router: int, life: int) -> None:
        """It is in that life now: what it declared in an earlier one is void."""
        known_life, declarations = self._declared.get(router, (life, []))
        if known_life < life:
            self._lose(router, declarations)
            del self._declared[router]

    def _gain(self, router: int, declarations: list[Declaration]) -> None:
        for _, topic in declarations:
            listeners = self._listeners.setdefault(topic, []) if topic else None
            if listeners is not None and router not in listeners:
                insort(listeners, router)
                self._knows(router, topic, True)
                self.context.changed(topic)

    def _lose(self, router: int, declarations: list[Declaration]) -> None:
        for _, topic in declarations:
            if topic and router in self._listeners[topic]:
                self._listeners[topic].remove(router)
                self._knows(router, topic, False)
                self.context.changed(topic)

    def _knows(self, other: int, topic: str, holds: bool) -> None:
        if other != self.host and topic in self._published:
            self.context.knows(self.host, other, topic, holds)

    # Messages.

    def forward(self, message: Message, publication: Publication, to: Sequence[int],
                first_ns: int, hops: int) -> None:
        """One copy to each neighbour that is on the way from the publisher to some of ``to``."""
        ways = self.topology.hops(publication.source)
        groups: dict[int | None, list[int]] = {}
        for receiver in to:
            groups.setdefault(ways.get(receiver), []).append(receiver)
        for neighbour, group in groups.items():
            link = self.links.get(neighbour)
            if link is not None and hops < len(self.context.hosts):
                link.line.offer(Parcel(message, publication, tuple(group), first_ns, hops + 1))
            else:
                for receiver in group:
                    publication.lost(message, receiver, "no_route", first_ns, first_ns)

    def received(self, parcel: Parcel) -> None:
        to, own = parcel.to, self.host
        parcel.gone = True
        if own in to:
            parcel.publication.arrived(parcel, own)
            to = tuple(receiver for receiver in to if receiver != own)
        if to:
            self.forward(parcel.message, parcel.publication, to, parcel.first_ns, parcel.hops)

    def discard(self, publication: Publication, reason: str) -> None:
        """A publisher of its host is gone, and what waits with it."""
        for link in self.links.values():
            for parcel in link.line.parcels():
                if parcel.publication is publication:
                    parcel.drop(reason)


def _states_came(link: Link, states: dict[int, State]) -> None:
    link.router.hear_states(link, states)


def _declared_came(link: Link, parts: list[Part]) -> None:
    link.router.hear_declared(link, parts)
