"""A host's router: it exchanges link states and declarations with others, and forwards messages."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from desim.middleware.zenoh.gossip import Gossip
from desim.middleware.zenoh.link import SERVICE, RouterLink
from desim.middleware.zenoh.link_queue import Push
from desim.middleware.zenoh.link_state_flood import LinkStateFlood
from desim.middleware.zenoh.registry import Declaration, DeclarationRegistry, Part
from desim.middleware.zenoh.sizes import DECLARATIONS_BYTES
from desim.middleware.zenoh.topology import bits

if TYPE_CHECKING:
    from desim.middleware.message import Message
    from desim.middleware.tcp import Connection, Tcp
    from desim.middleware.zenoh.discovery import Finder
    from desim.middleware.zenoh.parameters import ZenohParams
    from desim.middleware.zenoh.publication import ZenohPublication
    from desim.ports.middleware import MiddlewareContext
    from desim.ports.networks import Handle

_NO_WAY = -1  # in place of a neighbour


class ZenohRouter:
    """A router from its host's start to its stop, which is its ``life``. Nodes declare as soon as
    the router has opened.

    Link states are flooded: each router passes new ones to its neighbours. Declarations of a router
    go along its tree of shortest ways, some time after the topology has changed. A router without a
    way to it is offline, and its declarations do not count.
    """

    def __init__(self, host: int, context: MiddlewareContext, params: ZenohParams,
                 tcp: Tcp, finder: Finder) -> None:
        self.host, self.life = host, context.life(host)
        self.context, self.params, self.tcp = context, params, tcp
        self.constants = params.constants
        self.links: dict[int, RouterLink] = {}  # open ones, by peer
        self.network = Gossip(self) if params.mode == "peer" else LinkStateFlood(self)
        self.topology = self.network.topology
        self.finder = finder
        self.registry = DeclarationRegistry(host, self.life, context)
        self._most_hops = len(context.hosts)
        self._online = 1 << host  # as bits
        self._ends: dict[RouterLink, None] = {}  # opening ones too
        self._held_back: list[list[Declaration]] = []  # of nodes, until it opens
        self._opened = False
        self._timers: dict[Callable[[], object], Handle] = {}
        self.book(self._open, self.constants.open_wait_ns)
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

    def calls(self, peer: int) -> bool:
        """Whether it has an open link to ``peer``, or is opening one."""
        return any(link.peer == peer and (link.up or link.connection.client == self.host)
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
        """``link`` has opened."""
        self._take(link)
        # A peer opens as soon as it has found those that have answered it.
        if self.params.mode == "peer" and not self._opened and all(end.up for end in self._ends):
            self._timers.pop(self._open).cancel()
            self._open()

    def _take(self, link: RouterLink) -> None:
        """Use a new link. If two routers dialled each other, the second one is a spare. One beside
        one that has expired ends with it."""
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
        self.network.link(peer, True)
        self.network.greet(link)
        self.topology_changed()
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
            self.network.link(link.peer, False)
            self.topology_changed()
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

    def topology_changed(self) -> None:
        self.network.changed()
        self._review()

    def book(self, what: Callable[[], object], delay_ns: int) -> None:
        """Call ``what`` once after a delay, no matter how often it is booked meanwhile."""
        if what not in self._timers:
            self._timers[what] = self.context.at(self.context.now_ns + delay_ns, self.host,
                                                 self._run_timer, what)

    def _run_timer(self, what: Callable[[], object]) -> None:
        del self._timers[what]
        what()

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

    def spread_all(self) -> None:
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
                link.line.offer(Push(message, publication, (to[0],), first_ns, last_ns,
                                       hops + 1))
                return
        groups: dict[int, list[int]] = {}
        for receiver in to:
            groups.setdefault(ways.get(receiver, _NO_WAY), []).append(receiver)
        for neighbour, group in groups.items():
            link = self.links.get(neighbour)
            if link is not None and hops < self._most_hops:
                link.line.offer(Push(message, publication, tuple(group), first_ns, last_ns,
                                       hops + 1))
            else:
                for receiver in group:
                    publication.lost(message, receiver, "no_route", first_ns, last_ns)

    def received(self, push: Push) -> None:
        to, own = push.to, self.host
        push.gone = True
        if own in to:
            push.publication.arrived(push, own)
            if len(to) == 1:
                return
            to = tuple(receiver for receiver in to if receiver != own)
        if to:
            self.context.relay(push.message, own)
            self.forward(push.message, push.publication, to, push.first_ns, push.last_ns,
                         push.hops)

    def discard(self, publication: ZenohPublication, reason: str) -> None:
        """A publisher of its host is gone, and its waiting messages with it."""
        for link in self.links.values():
            for push in link.line.pushes():
                if push.publication is publication:
                    push.drop(reason)
