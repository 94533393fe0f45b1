"""All hosts and topics of a run, and the account of every message.

``publish`` makes a ``Message``; the registries name the hosts that listen; the publisher's
transport takes it to them; each of them puts it into its subscriptions' queues and runs the
callbacks in phase CONTROL of the same instant, or into its ``PolledSubscription``, where a node
reads it later. Every message between hosts leaves rows in the trace: ``sent`` (entity: the source),
``frame`` for each frame (the source), ``lost`` for each frame that a stream will send again,
``delivered`` or ``dropped``, ``callback`` or ``read``, ``repeated``, ``overwritten`` (the
destination). Hosts that a broadcast did not reach have one row together, of the medium and with the
reason as its kind.

A message is dropped for what a datagram's frame was dropped for, or as ``outbox_full``,
``link_closed`` (its receiver stopped or no longer listens), ``sender_down``, ``no_route`` (no
medium in common), for what befell its datagrams in sockets (``send_buffer_full``,
``receive_buffer_full``, ``reassembly_full``: ``desim.middleware.udp``), or as ``no_subscriber`` (it
came to a host where nobody listens any more).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from desim.engine.kernel import Kernel
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace, pack
from desim.errors import InputError, below, did_you_mean
from desim.middleware.arrivals import Arrivals
from desim.middleware.batches.publisher import BatchPublisher
from desim.middleware.busy.host import BusyHost
from desim.middleware.context import GraphContext
from desim.middleware.graph_options import PLAIN, GraphOptions
from desim.middleware.host import Host, receive_all
from desim.middleware.message import Message
from desim.middleware.routes import Routing
from desim.middleware.topics import PolledSubscription, Topic
from desim.ports import natural_key
from desim.ports.middleware import HasDomains, Middleware

if TYPE_CHECKING:
    from desim.network.association_rows import AssociationRows
    from desim.network.background import BackgroundFlow
    from desim.network.medium import Medium

_SELDOM = (1 << 12) - 1  # rows and latencies are flushed after so many messages: a mask

# Host, kind, points [n, 2] m, texts [n] or none.
OnDisplay = Callable[[str, str, np.ndarray, tuple[str, ...]], object]


class Graph:
    """All hosts and topics of a run, and the account of every message.

    ``hosts``: names in any order; their indices follow the natural order, and ``by_name`` has them
    all."""

    def __init__(self, kernel: Kernel, names: Names, trace: Trace, streams: Streams,
                 middleware: Middleware, hosts: Iterable[str], options: GraphOptions = PLAIN
                 ) -> None:
        self.kernel, self.names, self.trace, self.streams = kernel, names, trace, streams
        self.put = trace.put
        self.middleware = middleware
        self.payloads, computers = options.payloads, options.computers
        self.read_at_birth = self.payloads == "birth"
        self.on_fate = options.on_fate
        self.passages = options.passages
        self.callbacks, self.sockets = options.callbacks, options.sockets
        self.SENT, self.FRAME, self.LOST = map(names.id, ("sent", "frame", "lost"))
        self.DROPPED = names.id("dropped")
        self.CALLBACK, self.READ = names.id("callback"), names.id("read")
        self.OVERWRITTEN = names.id("overwritten")
        # By kind of row: fn(host name, a, b, c).
        self.listeners: dict[str, Callable[[str, int, int, int], object]] = {}
        self.on_display: OnDisplay | None = None
        self.topics: dict[str, Topic] = {}
        self.media: list[Medium] = []
        self.inside: list[Medium] = []  # media within hosts
        self.routes = Routing(self)
        self.expecting: dict[PolledSubscription, None] = {}  # with messages on their way
        self.batches: list[BatchPublisher] = []
        self.background: list[BackgroundFlow] = []
        self.associations: dict[str, AssociationRows] = {}  # by medium
        self.connections = 0  # grows when hosts begin to publish or to listen, start or stop
        self.messages = 0  # between hosts, so far
        self.hosts = [Host(self, name, index) if computers is None
                      else BusyHost(self, name, index, computers[name])
                      for index, name in enumerate(sorted(hosts, key=natural_key))]
        self.up = [False] * len(self.hosts) + [True] * options.others
        self.arrivals = Arrivals(trace, names.id("delivered"), self.hosts, options.on_fate,
                                 self.payloads == "delivery")
        for host, last_ns in zip(self.hosts, self.arrivals.last_ns, strict=True):
            host.last_arrival_ns = last_ns
        self.by_name = {host.name: host for host in self.hosts}
        trace.before_flush = self.catch_up
        # Hosts of different domains never hear of each other.
        self.domains: Sequence[int] = [0] * len(self.hosts)
        with below("middleware"):
            if isinstance(middleware, HasDomains):
                self.domains = middleware.domains([host.name for host in self.hosts])
            self.context: GraphContext = GraphContext(self, middleware)
            middleware.start(self.context)

    def host(self, name: str) -> Host:
        if name not in self.by_name:
            raise InputError(f"no host {name!r}{did_you_mean(name, self.by_name)}; known: "
                             f"{', '.join(self.by_name)}")
        return self.by_name[name]

    def without_hosts(self, topic: str) -> str:
        """A topic's or node's name without the names of hosts: ``scan`` of ``/robot_3/scan``."""
        return "/".join(part for part in topic.split("/") if part and part not in self.by_name)

    def topic(self, name: str) -> Topic:
        """The topic of this absolute name."""
        about = self.topics.get(name)
        if about is None:
            about = self.topics[name] = Topic(name, self.names.id(name), self.arrivals.tallies)
        return about

    def attach(self, medium: Medium, hosts: Iterable[str] | None = None) -> None:
        """Give ``hosts`` (default: all) an interface to ``medium``, after those they have."""
        self.media.append(medium)
        medium.flights.up = self.up
        attached = self.hosts if hosts is None else [self.host(host) for host in hosts]
        give_interfaces(medium, (host.index for host in attached))
        for host in attached:
            host.media.append(medium)

    def put_inside(self, medium: Medium, host: int) -> None:
        """``medium`` is inside ``host``, between its nodes."""
        self.inside.append(medium)
        medium.flights.up = self.up
        give_interfaces(medium, [host])

    def linked(self, hosts: np.ndarray) -> np.ndarray | None:
        """``Medium.linked`` of ``hosts``, each pair over the way that its messages take."""
        if self.routes.detours:
            return self._linked_by_ways(hosts)
        links = np.zeros((len(hosts), len(hosts)), bool)
        open_ = np.ones_like(links)  # pairs that have no medium yet
        for medium in self.media:
            attached = np.array([medium in self.hosts[host].media for host in hosts.tolist()], bool)
            pairs = open_ & attached[:, None] & attached[None, :]
            reached = medium.linked(hosts)
            if reached is None and pairs.all():
                return None
            links |= pairs if reached is None else pairs & reached
            open_ &= ~pairs
        return links

    def _linked_by_ways(self, hosts: np.ndarray) -> np.ndarray:
        """The same where a pair has a way of its own."""
        everybody = np.arange(len(self.hosts))
        reached = {medium: medium.linked(everybody) for medium in self.media}
        links = np.zeros((len(hosts), len(hosts)), bool)
        for i, j in np.ndindex(links.shape):
            legs = self.routes.legs(int(hosts[i]), int(hosts[j])) if i != j else ()
            begins = [int(hosts[i]), *(host for _, host in legs)]
            links[i, j] = i == j or bool(legs) and all(
                (matrix := reached[medium]) is None or matrix[begin, end]
                for begin, (medium, end) in zip(begins, legs, strict=False))
        return links

    def start(self) -> None:
        """Start every host."""
        for host in self.hosts:
            host.start()

    def depart(self, message: Message, receivers: int) -> None:
        """``message`` sets out for ``receivers`` other hosts."""
        self.messages = message.number = number = self.messages + 1
        about, put = message.about, self.put
        about.counts.intended += receivers
        put(pack(message.born_ns, self.SENT, message.origin.id, about.id, message.seq,
                 message.size_bytes))
        if not number & _SELDOM:
            self.trace.flush_if_full()

    def record_frame(self, source: int, to: int, seq: int, size_bytes: int) -> None:
        """Write the trace row of a frame with bytes of message ``seq``, between trace ids."""
        self.put(pack(self.kernel.now_ns, self.FRAME, source, to, seq, size_bytes))

    def deliver(self, message: Message, receiver: int, first_ns: int, last_ns: int) -> None:
        """``message`` has arrived at host ``receiver``."""
        host = self.hosts[receiver]
        if host.receive(message):
            self.arrivals.note(message, host, self.kernel.now_ns, first_ns, last_ns)
        else:
            self.drop(message, receiver, "no_subscriber", first_ns, last_ns)

    def deliver_all(self, message: Message, receivers: Sequence[int]) -> None:
        """``message``, a datagram, has arrived at several hosts in one instant: ``deliver`` at
        each. ``receivers`` are in the order of their trace ids."""
        listening = receive_all(message, receivers)
        now_ns, born_ns, hosts = self.kernel.now_ns, message.born_ns, self.hosts
        if len(listening) < len(receivers):
            for receiver in receivers:
                if receiver not in listening:
                    self.drop(message, receiver, "no_subscriber", born_ns, born_ns)
        for receiver in listening:
            self.arrivals.note(message, hosts[receiver], now_ns, born_ns, born_ns)

    def catch_up(self) -> None:
        """Enter in the account what has arrived by now at those who were not waiting for it."""
        for latest in tuple(self.expecting):
            latest.catch_up()
        for batches in self.batches:
            batches.catch_up()
        self.arrivals.enter()
        for medium in chain(self.media, self.inside):
            medium.flights.catch_up()

    def forget_batches(self, host: Host) -> None:
        """The publishers of ``host`` are gone."""
        self.catch_up()
        self.batches = [batches for batches in self.batches if batches.host is not host]

    def book_expected(self) -> None:
        """Make events of all arrivals to come: what follows may change them."""
        self.connections += 1
        for latest in tuple(self.expecting):
            latest.book()
        for batches in self.batches:
            batches.release()

    def repeat(self, message: Message, receiver: int) -> None:
        """A copy of ``message`` has arrived at host ``receiver``, which has had it."""
        message.about.counts.repeated += 1
        self.trace.row(self.kernel.now_ns, self.names.id("repeated"), self.hosts[receiver].id,
                       message.origin.id, message.seq, message.about.id)

    def drop(self, message: Message, receiver: int, reason: str, first_ns: int = -1,
             last_ns: int = -1) -> None:
        """``message`` will never be at host ``receiver``."""
        now_ns = self.kernel.now_ns
        message.about.counts.drop(reason)
        self.trace.row(now_ns, self.DROPPED, self.hosts[receiver].id, message.origin.id,
                       message.seq, self.names.id(reason))
        if self.on_fate is not None:
            self.on_fate(message, receiver, now_ns, reason, first_ns, last_ns)

    def miss(self, message: Message, receivers: Collection[int], reason: str,
             medium: Medium) -> None:
        """A broadcast did not reach ``receivers``: one row, of kind ``reason``, of the medium's."""
        now_ns = self.kernel.now_ns
        message.about.counts.drop(reason, len(receivers))
        self.trace.row(now_ns, self.names.id(reason), medium.id, message.origin.id, message.seq,
                       len(receivers))
        if self.on_fate is not None:
            for receiver in receivers:
                self.on_fate(message, receiver, now_ns, reason, message.born_ns, message.born_ns)

    def changed(self, topic: str) -> None:
        """The registries answer differently now for publishers of ``topic``."""
        about = self.topics.get(topic)
        if about is not None:
            for publisher in about.publishers:
                publisher.changed()


def give_interfaces(medium: Medium, hosts: Iterable[int]) -> None:
    """Let ``hosts`` (indices) alone have an interface to ``medium``. To its model the others are as
    hosts that have stopped."""
    before, medium.attached = medium.attached, sorted(hosts)
    for host in sorted({*before} ^ {*medium.attached}):
        medium.switched(host, host in medium.attached)
