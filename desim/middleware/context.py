"""Between the graph and its middleware: what this one is told and asked, what it may do
(``ports.middleware.MiddlewareContext``), and the account of both."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from desim.engine.kernel import Call, Phase
from desim.engine.trace import pack
from desim.middleware.answers import transport_of
from desim.middleware.beliefs import Beliefs
from desim.middleware.transports import Datagram, Stream
from desim.ports.middleware import Endpoint, Middleware, Offer, Transport

if TYPE_CHECKING:
    from desim.middleware.arp import Neighbours
    from desim.middleware.graph import Graph
    from desim.network.medium import Medium


# Takes note of when (ns) something will be heard, by whom it is heard then, and of what.
Note = Callable[[int, Callable[[Any, int], Any], Any], Any]

ACKS = "ack"  # the kind of TCP's acknowledgements, of which those of messages are no discovery


class Context:
    """Over one ``Graph``. ``discovery_bytes`` are those of the middleware's own frames by their
    kind, with all headers, ``discovery_frames`` how many there were.

    Each of these frames is a trace row ``control`` (entity: the source; a: the receiver, or the
    medium of a multicast; b: the kind; c: its bytes). One that gets lost leaves none: it is in the
    medium's account. Those in ``watchers`` are called with each host that starts or stops.
    ``neighbours``: who knows whose address; None: all are known (TCP says which).
    """

    def __init__(self, graph: Graph, middleware: Middleware) -> None:
        self.graph = graph
        self.middleware = middleware
        self.transport: Callable[[Offer], Transport] = (
            partial(transport_of, middleware) if hasattr(middleware, "transport") else self._plain)
        self.hosts = tuple(host.name for host in graph.hosts)
        self.discovery_bytes: dict[str, int] = {}
        self.discovery_frames: dict[str, int] = {}
        informed = getattr(middleware, "informed", None)
        self.beliefs = None if informed is None else Beliefs(
            informed, self.note, [host.id for host in graph.hosts], graph.names.id)
        self.neighbours: Neighbours | None = None
        self.watchers: list[Callable[[int, bool], Any]] = []
        self.changed = graph.changed
        self._control = graph.names.id("control")

    # What the graph says.

    def started(self, host: int) -> None:
        for watcher in self.watchers:
            watcher(host, True)
        self.middleware.switched(host, True)

    def stopped(self, host: int) -> None:
        if self.beliefs is not None:
            self.beliefs.stops(host)
        for watcher in self.watchers:
            watcher(host, False)
        self.middleware.switched(host, False)

    def advertised(self, offer: Offer) -> None:
        if self.beliefs is not None:
            self.beliefs.advertises(offer.publisher.host, offer.publisher.topic)
        self.middleware.advertise(offer)

    def subscribed(self, subscriber: Endpoint) -> None:
        if self.beliefs is not None:
            self.beliefs.subscribes(subscriber.host, subscriber.topic)
        self.middleware.subscribe(subscriber)

    def _plain(self, offer: Offer) -> Transport:
        """By what a publisher's messages travel where the middleware leaves it to desim."""
        host = self.graph.hosts[offer.publisher.host]
        if (offer.transport, offer.via) == ("stream", "unicast"):
            return Stream(host, offer.queue)
        return Datagram(host, offer.via == "broadcast")

    # What the middleware may know and do.

    now_ns = property(attrgetter("graph.kernel.now_ns"))

    def at(self, time_ns: int, host: int, fn: Callable[[Any], Any], arg: Any = None) -> Call:
        graph = self.graph
        return graph.kernel.at(time_ns, Phase.NETWORK, graph.hosts[host].id, fn, arg)

    def up(self, host: int) -> bool:
        return self.graph.up[host]

    def stream(self, *name: str | int) -> np.random.Generator:
        return self.graph.streams("middleware", *name)

    def knows(self, believer: int, other: int, topic: str, holds: bool) -> None:
        if self.beliefs is not None:
            self.beliefs.knows(believer, other, topic, holds)

    def sees(self, believer: int, other: int, state: str) -> None:
        if self.beliefs is not None:
            self.beliefs.sees(believer, other, state)

    def note(self, kind: str, host: int, a: int = 0, b: int = 0, c: int = 0) -> None:
        """A trace row of ``host``."""
        graph = self.graph
        graph.trace.row(graph.kernel.now_ns, graph.names.id(kind), graph.hosts[host].id, a, b, c)

    def send(self, kind: str, source: int, receivers: Sequence[int], size_bytes: int,
             heard: Callable[[Any, int], Any], token: Any = None, *, segments: int = 1,
             multicast: bool = False,
             in_part: Callable[[Any, int, dict[int, str]], Any] | None = None,
             notes: Callable[[int], Note | None] | None = None) -> None:
        """See ``MiddlewareContext``. ``notes``: what a receiver notes instead of hearing it, where
        the medium says at once when it will be there (``Medium.post``); None if it wants to hear
        it."""
        graph, hosts = self.graph, self.graph.hosts
        by_medium: dict[Medium, list[int]] = {}
        for receiver in sorted(receivers):
            medium = graph.route(hosts[source], receiver)
            if medium is not None:
                by_medium.setdefault(medium, []).append(receiver)
        carrier = _Heard(heard, in_part)
        if segments > 1 or multicast or self.neighbours is not None:
            notes = None
        now_ns, own, kind_id = graph.kernel.now_ns, hosts[source].id, graph.names.id(kind)
        for medium, group in by_medium.items():
            several = [tuple(group)] if multicast else [(one,) for one in group]
            self._account(kind, len(several), size_bytes)
            for receivers_ in several:
                to = medium.id if multicast else hosts[receivers_[0]].id
                graph.put(pack(now_ns, self._control, own, to, kind_id, size_bytes))
                note = None if notes is None else notes(receivers_[0])
                if note is None:
                    self.sends(medium, source, receivers_)(
                        source, receivers_, size_bytes, segments, multicast, carrier, token)
                    continue
                due_ns = medium.post(source, receivers_, size_bytes, carrier, token)
                if due_ns is not None:
                    note(due_ns, heard, token)
        graph.trace.look()

    def sends(self, medium: Medium, source: int, receivers: Sequence[int]
              ) -> Callable[..., int | None]:
        """What a datagram of ``source`` leaves by, called as ``Medium.transmit``: one that is for a
        single host needs its address."""
        if self.neighbours is None or len(receivers) > 1:
            return medium.transmit
        return self.neighbours.of(medium, source, receivers[0]).transmit

    def book(self, kind: str, source: int, to: int, size_bytes: int) -> None:
        """Account for a frame of the middleware's own that ``source`` sends; ``to`` is a trace
        id."""
        self._account(kind, 1, size_bytes)
        graph = self.graph
        graph.trace.row(graph.kernel.now_ns, self._control, graph.hosts[source].id, to,
                        graph.names.id(kind), size_bytes)

    def _account(self, kind: str, frames: int, size_bytes: int) -> None:
        """Of so many frames of one size."""
        self.discovery_bytes[kind] = self.discovery_bytes.get(kind, 0) + frames * size_bytes
        self.discovery_frames[kind] = self.discovery_frames.get(kind, 0) + frames


class _Heard:
    """The carrier of frames of which only the arrival matters. A protocol over UDP hears a frame
    that is repeated once more."""

    socket = "discovery"  # a host's registry sends all by one

    __slots__ = ("arrived", "repeated", "_in_part")

    def __init__(self, heard: Callable[[Any, int], Any],
                 in_part: Callable[[Any, int, dict[int, str]], Any] | None) -> None:
        self.arrived = self.repeated = heard
        self._in_part = in_part

    def arrived_in_part(self, token: Any, receiver: int, lost: dict[int, str]) -> None:
        """A datagram is lost with any packet of it, unless the frame is a train of several."""
        if self._in_part is not None:
            self._in_part(token, receiver, lost)

    def lost(self, token: Any, receiver: int, reason: str) -> None:
        """Nobody is told."""

    def missed(self, token: Any, receivers: Collection[int], reason: str, medium: Medium) -> None:
        """Nobody is told."""

    def unresolved(self, token: Any) -> None:
        """Nobody is told."""
