"""Hosts, their nodes, and the topics between them.

``publish`` makes a ``Message``; the registries name the hosts that listen; the publisher's
transport takes it to them; each of them puts it into its subscriptions' queues and runs the
callbacks in phase CONTROL of the same instant. Every message between hosts leaves rows in the
trace: ``sent`` (entity: the source), ``frame`` for each frame (the source), ``lost`` for each frame
that a stream will send again (the destination), ``delivered`` or ``dropped`` (the destination),
``callback``.

A message is dropped for what a datagram's frame was dropped for, or as ``outbox_full``,
``link_closed`` (its receiver stopped or no longer listens), ``sender_down``, ``no_route`` (no
medium in common) or ``no_subscriber`` (it came to a host where nobody listens any more).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterable
from typing import TYPE_CHECKING

import numpy as np

from desim.engine.kernel import Kernel, Phase
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace, pack
from desim.errors import InputError, KernelError, below, did_you_mean
from desim.middleware.context import GraphContext
from desim.middleware.node import Node
from desim.middleware.topics import Latest, Message, Publisher, Subscription, Topic
from desim.ports import natural_key
from desim.ports.middleware import Addressing, Endpoint, Middleware, Offer, TransportKind

if TYPE_CHECKING:
    from desim.network.medium import Medium

__all__ = ["Graph", "Host", "Message", "Node"]

MAX_CALLBACKS = 100_000  # on one host in one instant

_SELDOM = (1 << 8) - 1  # rows and latencies are flushed after so many messages: a mask

_CONTROL = Phase.CONTROL  # looking a member up costs more than using it

Ends = tuple[Latest | None, list[Subscription]]  # of one topic on one host

OnFate = Callable[[Message, int, int, "str | None", int, int], object]


class Host:
    """A computer: interfaces to media, and nodes that run while it is up.

    ``software`` makes the nodes, afresh at every start. ``received_ns`` has by host index the time
    of the last message of each other host since its start (0: none); the function in ``awaited``,
    by host index too, is called once, when the next message of that host arrives.
    """

    __slots__ = ("graph", "name", "index", "id", "media", "software", "nodes", "published",
                 "received_ns", "awaited", "_publishers", "_ends", "_inbox", "_awake")

    def __init__(self, graph: Graph, name: str, index: int) -> None:
        self.graph = graph
        self.name = name
        self.index = index
        self.id = graph.names.id(name)
        self.media: list[Medium] = []  # in order of preference
        self.software: Callable[[Host], list[Node]] = lambda host: []
        self.nodes: list[Node] = []
        self.published = 0
        self.received_ns: list[int] = []
        self.awaited: dict[int, Callable[[], object]] = {}
        self._publishers: list[Publisher] = []
        self._ends: dict[str, Ends] = {}
        self._inbox: deque[tuple[Subscription, Message]] = deque()
        self._awake = False  # the inbox is being emptied, or will be in this instant

    @property
    def up(self) -> bool:
        return self.graph.up[self.index]

    @property
    def tx_bytes(self) -> int:
        """Bytes of frames that its interfaces sent, with headers."""
        return sum(medium.tx_bytes[self.index] for medium in self.media)

    @property
    def rx_bytes(self) -> int:
        """Bytes of frames that its interfaces received, with headers."""
        return sum(medium.rx_bytes[self.index] for medium in self.media)

    def start(self) -> None:
        """Run fresh nodes. Harmless on a host that is up."""
        if self.up:
            return
        graph = self.graph
        graph.up[self.index] = True
        self._notify_media(True)
        graph.trace.row(graph.kernel.now_ns, graph.names.id("host_started"), self.id)
        graph.context.started(self.index)
        self.nodes = self.software(self)
        for node in self.nodes:
            node.start()

    def stop(self) -> None:
        """Stop, and lose all memory: timers, queues, outboxes, subscriptions. Frames that it has
        sent go on; frames on their way to it are dropped as ``host_down``."""
        if not self.up:
            return
        graph = self.graph
        graph.up[self.index] = False
        self._notify_media(False)
        graph.trace.row(graph.kernel.now_ns, graph.names.id("host_stopped"), self.id)
        for node in self.nodes:
            node.stop()
        for publisher in self._publishers:
            publisher.topic.publishers.remove(publisher)
            publisher.close("sender_down")
        for subscription, _ in self._inbox:
            subscription.topic.counts.discarded += 1
        for topic in self._ends:
            graph.topic(topic).listens(self.index, False)
        self.nodes = []
        self._publishers = []
        self._ends = {}
        self._inbox.clear()
        self.received_ns = [0] * len(graph.hosts)
        graph.context.stopped(self.index)

    def _notify_media(self, up: bool) -> None:
        for medium in self.media:
            medium.switched(self.index, up)

    def absolute(self, topic: str) -> str:
        """``scan`` on ``robot_3`` is ``/robot_3/scan``; with a leading slash it is absolute."""
        return topic if topic.startswith("/") else f"/{self.name}/{topic}"

    def advertise(self, node: str, topic: str, transport: str, via: str, queue: int,
                  latch: bool) -> Publisher:
        """A publisher of ``topic`` for ``node``; see ``Node.advertise``."""
        about = self.graph.topic(self.absolute(topic))
        try:
            offer = Offer(Endpoint(self.index, node, about.name), TransportKind(transport),
                          Addressing(via), queue, latch)
        except ValueError:
            raise InputError(f"topic {about.name}: no transport {transport!r} via {via!r}; "
                             "allowed: stream or datagram, unicast or broadcast") from None
        publisher = Publisher(self, about, offer)
        about.publishers.append(publisher)
        self._publishers.append(publisher)
        self.graph.context.advertised(offer)
        return publisher

    def subscribe(self, node: str, topic: str, callback: Callable[[Message], object],
                  queue: int) -> None:
        """See ``Node.subscribe``."""
        about = self.graph.topic(self.absolute(topic))
        self._ends_of(about.name)[1].append(Subscription(about, callback, queue))
        about.listens(self.index, True)
        self.graph.context.subscribed(Endpoint(self.index, node, about.name))

    def latest(self, node: str, topic: str) -> Latest:
        """See ``Node.latest``."""
        name = self.absolute(topic)
        latest, subscriptions = self._ends_of(name)
        if latest is None:
            latest = Latest()
            self._ends[name] = latest, subscriptions
            self.graph.topic(name).listens(self.index, True)
        self.graph.context.subscribed(Endpoint(self.index, node, name))
        return latest

    def _ends_of(self, topic: str) -> Ends:
        return self._ends.setdefault(topic, (None, []))

    def receive(self, message: Message) -> bool:
        """Put ``message`` into the queues of its topic's subscriptions; False if there are none."""
        about = message.about
        ends = self._ends.get(about.name)
        if ends is None:
            return False
        latest, subscriptions = ends
        if latest is not None:
            latest.message = message
            if not subscriptions:
                return True
        if not self._awake:
            self._awake = True
            self.graph.kernel.after(0, _CONTROL, self.id, self._drain)
        for subscription in subscriptions:
            if 0 < subscription.limit <= subscription.waiting:
                self._overwrite(subscription)
            subscription.waiting += 1
            self._inbox.append((subscription, message))
        about.counts.queued += len(subscriptions)
        return True

    def _overwrite(self, subscription: Subscription) -> None:
        """Drop the oldest message of a full queue."""
        oldest = next(i for i, entry in enumerate(self._inbox) if entry[0] is subscription)
        message = self._inbox[oldest][1]
        del self._inbox[oldest]
        subscription.waiting -= 1
        message.about.counts.overwritten += 1
        graph = self.graph
        graph.trace.row(graph.kernel.now_ns, graph.OVERWRITTEN, self.id, message.origin.id,
                        message.seq, message.about.id)

    def _drain(self, _: object) -> None:
        """Run the callbacks of all waiting messages, in order of arrival, and of those that they
        publish to their own host meanwhile."""
        inbox = self._inbox
        graph, own = self.graph, self.id
        now_ns, put, callback = graph.kernel.now_ns, graph.put, graph.CALLBACK
        for _ in range(MAX_CALLBACKS):
            if not inbox:
                self._awake = False
                return
            subscription, message = inbox.popleft()
            subscription.waiting -= 1
            about = message.about
            about.counts.called += 1
            put(pack(now_ns, callback, own, message.origin.id, message.seq, about.id))
            subscription.callback(message)
        raise KernelError(f"more than {MAX_CALLBACKS} callbacks on {self.name} at {now_ns} ns: the "
                          f"loop goes through topic {about.name}")


class Graph:
    """All hosts and topics of a run, and the account of every message.

    ``hosts``: names in any order; their indices follow the natural order. ``payloads`` says when a
    lazy content is read: ``lazy`` (by the callback that wants it), ``birth`` or ``delivery``; no
    result depends on it. ``on_fate(message, receiver, time_ns, reason, first_ns, last_ns)`` is
    called with each message's fate at each receiving host: ``reason`` None for delivered, the
    instants of its first and last frame, -1 for a message that never became a frame."""

    def __init__(self, kernel: Kernel, names: Names, trace: Trace, streams: Streams,
                 middleware: Middleware, hosts: Iterable[str], *, payloads: str = "lazy",
                 on_fate: OnFate | None = None) -> None:
        if payloads not in ("lazy", "birth", "delivery"):
            raise InputError(f"payloads are read lazy, at birth or at delivery, not {payloads!r}")
        self.kernel, self.names, self.trace, self.streams = kernel, names, trace, streams
        self.put = trace.put
        self.middleware = middleware
        self.read_at_birth = payloads == "birth"
        self._read_at_delivery = payloads == "delivery"
        self._on_fate = on_fate
        self.SENT, self.FRAME, self.LOST = map(names.id, ("sent", "frame", "lost"))
        self.DELIVERED, self.DROPPED = names.id("delivered"), names.id("dropped")
        self.CALLBACK, self.OVERWRITTEN = names.id("callback"), names.id("overwritten")
        self.listeners: dict[str, Callable[[str], object]] = {}  # kind of row to fn(host name)
        self.topics: dict[str, Topic] = {}
        self.media: list[Medium] = []
        self.messages = 0  # between hosts, so far
        self.hosts = [Host(self, name, index)
                      for index, name in enumerate(sorted(hosts, key=natural_key))]
        self.up = [False] * len(self.hosts)
        for host in self.hosts:
            host.received_ns = [0] * len(self.hosts)
        self._by_name = {host.name: host for host in self.hosts}
        self.context = GraphContext(self, middleware)
        with below("middleware"):
            middleware.start(self.context)

    def host(self, name: str) -> Host:
        if name not in self._by_name:
            raise InputError(f"no host {name!r}{did_you_mean(name, self._by_name)}; known: "
                             f"{', '.join(self._by_name)}")
        return self._by_name[name]

    def topic(self, name: str) -> Topic:
        """The topic of this absolute name."""
        about = self.topics.get(name)
        if about is None:
            about = self.topics[name] = Topic(name, self.names.id(name))
        return about

    def attach(self, medium: Medium, hosts: Iterable[str] | None = None) -> None:
        """Give ``hosts`` (default: all) an interface to ``medium``, after those they have."""
        self.media.append(medium)
        medium.up = self.up
        attached = self.hosts if hosts is None else [self.host(host) for host in hosts]
        medium.attached = sorted(host.index for host in attached)
        for host in attached:
            host.media.append(medium)

    def route(self, source: Host, receiver: int) -> Medium | None:
        """The first of the source's media that the receiver is attached to as well."""
        others = self.hosts[receiver].media
        for medium in source.media:
            if medium in others:
                return medium
        return None

    def linked(self, hosts: np.ndarray) -> np.ndarray | None:
        """``Medium.linked`` of ``hosts``, each pair over the medium that its messages take."""
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

    def start(self) -> None:
        """Start every host."""
        for host in self.hosts:
            host.start()

    def depart(self, message: Message, receivers: int) -> None:
        """``message`` sets out for ``receivers`` other hosts."""
        self.messages = message.number = number = self.messages + 1
        about = message.about
        about.counts.intended += receivers
        self.put(pack(message.born_ns, self.SENT, message.origin.id, about.id, message.seq,
                      message.size_bytes))
        if not number & _SELDOM:
            self.trace.flush_if_full()
            for topic in self.topics.values():
                topic.counts.latency.flush()

    def record_frame(self, source: int, to: int, seq: int, size_bytes: int) -> None:
        """Write the trace row of a frame with bytes of message ``seq``, between trace ids."""
        self.put(pack(self.kernel.now_ns, self.FRAME, source, to, seq, size_bytes))

    def deliver(self, message: Message, receiver: int, first_ns: int, last_ns: int) -> None:
        """``message`` has arrived at host ``receiver``."""
        if self._read_at_delivery:
            message.content  # noqa: B018 - reading computes it
        host = self.hosts[receiver]
        if not host.receive(message):
            self.drop(message, receiver, "no_subscriber", first_ns, last_ns)
            return
        now_ns = self.kernel.now_ns
        latency_ns = now_ns - message.born_ns
        counts = message.about.counts
        counts.bytes += message.size_bytes
        counts.latency.add(latency_ns)
        source = message.origin.index
        host.received_ns[source] = now_ns
        if host.awaited and source in host.awaited:
            host.awaited.pop(source)()
        self.put(pack(now_ns, self.DELIVERED, host.id, message.origin.id, message.seq, latency_ns))
        if self._on_fate is not None:
            self._on_fate(message, receiver, now_ns, None, first_ns, last_ns)

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
        if self._on_fate is not None:
            self._on_fate(message, receiver, now_ns, reason, first_ns, last_ns)

    def miss(self, message: Message, receivers: Collection[int], reason: str,
             medium: Medium) -> None:
        """A broadcast did not reach ``receivers``: one row, of kind ``reason``, of the medium's."""
        now_ns = self.kernel.now_ns
        message.about.counts.drop(reason, len(receivers))
        self.trace.row(now_ns, self.names.id(reason), medium.id, message.origin.id, message.seq,
                       len(receivers))
        if self._on_fate is not None:
            for receiver in receivers:
                self._on_fate(message, receiver, now_ns, reason, message.born_ns, message.born_ns)

    def changed(self, topic: str) -> None:
        """The registries answer differently now for publishers of ``topic``."""
        about = self.topics.get(topic)
        if about is not None:
            for publisher in about.publishers:
                publisher.changed()
