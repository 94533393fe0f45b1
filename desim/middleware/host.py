"""A computer: interfaces to media, and nodes that run while it is up."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from desim.engine.agenda import Call
from desim.engine.kernel import Phase
from desim.engine.trace import pack, pack_each, pack_id
from desim.errors import InputError, KernelError
from desim.middleware.clocks import HostClock
from desim.middleware.message import Message
from desim.middleware.topics import PolledSubscription, Publisher, Subscription, Topic, WaitSet
from desim.middleware.udp.host_sockets import HostSockets
from desim.ports.middleware import Addressing, Advertisement, Endpoint, TransportKind
from desim.ports.networks import Handle

if TYPE_CHECKING:
    from desim.computers.computer import Computer
    from desim.middleware.busy.executor import Executor
    from desim.middleware.busy.memory import HostMemory
    from desim.middleware.graph import Graph
    from desim.middleware.node import Node
    from desim.middleware.transports import StreamLink
    from desim.network.medium import Medium

MAX_CALLBACKS = 100_000  # on one host in one instant

_CONTROL = Phase.CONTROL  # looking a member up costs more than using it

Ends = tuple[PolledSubscription | None, list[Subscription]]  # of one topic on one host


class Host:
    """A computer: interfaces to media, and nodes that run while it is up.

    ``software`` makes the nodes, afresh at every start. ``last_arrival_ns[k]`` is when host k last
    received a message of this host (0: not since k started); ``on_next_arrival[k](time_ns)`` is
    called once, when k receives the next one. ``calling``: the executor whose callback runs now;
    None where callbacks take no time, as on a host without a ``computer``: its work costs nothing.
    """

    # See ``Node``. Here the quantities are thrown away, without a call of a Python function: 920
    # instructions in place of 1100, 700 times a second in maze_30 (of 34 thousand Python calls).
    worked: Callable[..., None] = dict  # type: ignore[assignment] # the result, too
    computer: Computer | None = None
    memory: HostMemory | None = None
    programs: Collection[str] = ()  # that have run on its computer

    __slots__ = ("graph", "name", "index", "id", "packed_id", "media", "clock", "software",
                 "nodes", "published", "last_arrival_ns", "on_next_arrival", "_publishers", "_ends",
                 "_inbox", "_turn", "_off", "sockets", "refused", "calling")

    def __init__(self, graph: Graph, name: str, index: int) -> None:
        self.graph = graph
        self.name = name
        self.index = index
        self.id = graph.names.id(name)
        self.packed_id = pack_id(self.id)  # for rows of many hosts
        self.media: list[Medium] = []  # in order of preference
        self._off: Sequence[Medium] | None = None  # those whose interface is off; None: all
        self.clock: HostClock | None = None  # None: it shows the true time
        self.software: Callable[[Host], list[Node]] = lambda host: []
        self.nodes: list[Node] = []
        self.published = 0
        self.calling: Executor | None = None
        self.refused: deque[StreamLink] = deque()  # those whose interface is full
        self.sockets = HostSockets(self, graph.sockets)
        self.last_arrival_ns: np.ndarray
        self.on_next_arrival: dict[int, Callable[[int], object]] = {}
        self._publishers: list[Publisher] = []
        self._ends: dict[str, Ends] = {}
        # None, unless it is being emptied or will be in this instant. New lists lie where memory
        # is warm: a broadcast wakes many hosts.
        self._inbox: list[tuple[Subscription, Message]] | None = None
        self._turn = Call()  # to empty it
        self._turn.fn, self._turn.arg = self._drain, None

    @property
    def executors(self) -> Collection[Executor]:
        """The threads of its nodes; none where callbacks take no time."""
        return ()

    @property
    def missed_ticks(self) -> int:
        """The ticks that timers have missed so far."""
        return 0

    @property
    def up(self) -> bool:
        return self.graph.up[self.index]

    def clock_ns(self, time_ns: int) -> int:
        """The time that its clock shows at ``time_ns``, which is not after the present."""
        return time_ns if self.clock is None else self.clock.read(time_ns)

    @property
    def tx_bytes(self) -> int:
        """Bytes of frames that its interfaces sent, with headers."""
        total = 0
        for medium in self.media:
            total += medium.tx_bytes[self.index]
        return total

    @property
    def rx_bytes(self) -> int:
        """Bytes of frames that its interfaces received, with headers."""
        total = 0
        for medium in self.media:
            total += medium.rx_bytes[self.index]
        return total

    def start(self) -> None:
        """Run fresh nodes. Harmless on a host that is up."""
        if self.up:
            return
        graph = self.graph
        graph.book_expected()
        graph.up[self.index] = True
        for medium in self.media if self._off is None else self._off:
            medium.switched(self.index, True)
        graph.trace.row(graph.kernel.now_ns, graph.names.id("host_started"), self.id)
        graph.context.started(self.index)
        self.nodes = self.software(self)
        for node in self.nodes:
            node.start()

    def stop(self) -> None:
        """Stop, and lose all memory: timers, queues, outboxes, subscriptions. Frames that it has
        sent go on; frames on their way to it are dropped as ``host_down``."""
        self._end(self.media)

    def stop_software(self) -> None:
        """The same, but its interfaces stay on."""
        self._end(())

    def _end(self, media: Sequence[Medium]) -> None:
        """Stop the software, and the interfaces to ``media``."""
        if not self.up:
            return
        graph = self.graph
        graph.book_expected()
        graph.forget_batches(self)
        graph.up[self.index] = False
        self._off = media
        for medium in media:
            medium.switched(self.index, False)
        graph.trace.row(graph.kernel.now_ns, graph.names.id("host_stopped"), self.id)
        for node in self.nodes:
            node.stop()
        for publisher in self._publishers:
            publisher.topic.publishers.remove(publisher)
            publisher.close("sender_down")
        self.sockets.close()
        for subscription, _ in self._inbox or ():
            subscription.topic.counts.discarded += 1
        for topic in self._ends:
            graph.topic(topic).listens(self.index, None, ())
        self.nodes = []
        self._publishers = []
        self._ends = {}
        if self._inbox:
            self._inbox.clear()
        for host in graph.hosts:
            host.last_arrival_ns[self.index] = 0
        graph.context.stopped(self.index)

    def advertise(self, node: str, topic: str, transport: str, via: str, queue: int,
                  latch: bool) -> Publisher:
        """A publisher of the absolute ``topic`` for ``node``; see ``Node.advertise``."""
        about = self.graph.topic(topic)
        try:
            kinds = _kinds(transport, via)
        except ValueError:
            raise InputError(f"topic {about.name}: no transport {transport!r} via {via!r}; "
                             "allowed: stream or datagram, unicast or broadcast") from None
        advertised = Advertisement(Endpoint(self.index, node, about.name), *kinds, queue, latch)
        self.graph.connections += 1
        publisher = self._new_publisher(about, advertised)
        about.publishers.append(publisher)
        self._publishers.append(publisher)
        self.graph.context.advertised(advertised)
        return publisher

    def subscribe(self, node: str, topic: str, callback: Callable[[Message], object],
                  queue: int) -> Subscription:
        """See ``Node.subscribe``; ``topic`` is absolute."""
        about = self.graph.topic(topic)
        self.graph.connections += 1
        latest, subscriptions = self._ends_of(about.name)
        if latest is not None:
            latest.book()
        subscription = self._new_subscription(node, about, callback, queue)
        subscriptions.append(subscription)
        about.listens(self.index, latest, subscriptions)
        self.graph.context.subscribed(Endpoint(self.index, node, about.name))
        return subscription

    def latest(self, node: str, topic: str, wait_set: WaitSet | None) -> PolledSubscription:
        """See ``Node.latest``; ``topic`` is absolute."""
        self.graph.connections += 1
        latest, subscriptions = self._ends_of(topic)
        if latest is None:
            latest = self._new_latest(topic, wait_set)
            self._ends[topic] = latest, subscriptions
            self.graph.topic(topic).listens(self.index, latest, subscriptions)
        self.graph.context.subscribed(Endpoint(self.index, node, topic))
        return latest

    def ticker(self, node: str, name: str, frequency_hz: Fraction | int,
               callback: Callable[[int], object], start_ns: int) -> Handle:
        """A timer of ``node``, called ``name``; the first tick at ``start_ns``."""
        return self.graph.kernel.ticker(frequency_hz, _CONTROL, self.id, callback, start_ns)

    def after(self, node: str, name: str, delay_ns: int, fn: Callable[..., object], arg: object
              ) -> Handle:
        """Call ``fn(arg)``, which is ``node``'s, once, ``delay_ns`` from now."""
        return self.graph.kernel.after(delay_ns, _CONTROL, self.id, fn, arg)

    def block(self, node: str) -> None:
        """``node`` waits for room in the send buffer of a socket: it runs no callback meanwhile."""
        for one in self.nodes:
            if one.name == node:
                one.block()

    def unblock(self, node: str) -> None:
        """``node`` waits no more."""
        for one in self.nodes:
            if one.name == node:
                one.unblock()

    def _new_publisher(self, topic: Topic, advertised: Advertisement) -> Publisher:
        return Publisher(self, topic, advertised)

    def _new_subscription(self, node: str, topic: Topic, callback: Callable[[Message], object],
                          queue: int) -> Subscription:
        return Subscription(topic, callback, queue)

    def _new_latest(self, topic: str, wait_set: WaitSet | None) -> PolledSubscription:
        return PolledSubscription(self, wait_set)

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
            latest.put(message)
            if not subscriptions:
                return True
        inbox = self._inbox
        if inbox is None:
            inbox = self._inbox = []
            self.graph.kernel.soon(self._turn, _CONTROL, self.id)
        for subscription in subscriptions:
            if 0 < subscription.limit <= subscription.waiting:
                self._overwrite(inbox, subscription)
            subscription.waiting += 1
            inbox.append((subscription, message))
        about.counts.queued += len(subscriptions)
        return True

    def _overwrite(self, inbox: list[tuple[Subscription, Message]], subscription: Subscription
                   ) -> None:
        """Drop the oldest message of a full queue."""
        oldest = next(i for i, entry in enumerate(inbox) if entry[0] is subscription)
        subscription.waiting -= 1
        self.overwritten(inbox.pop(oldest)[1])

    def overwritten(self, message: Message) -> None:
        """``message`` has left a full queue."""
        message.about.counts.overwritten += 1
        graph = self.graph
        graph.trace.row(graph.kernel.now_ns, graph.OVERWRITTEN, self.id, message.origin.id,
                        message.seq, message.about.id)

    def _drain(self, _: object) -> None:
        """Run the callbacks of all waiting messages, in order of arrival, and of those that they
        publish to their own host meanwhile."""
        inbox = self._inbox or []
        graph, own = self.graph, self.id
        now_ns, put, called = graph.kernel.now_ns, graph.put, graph.CALLBACK
        for _ in range(MAX_CALLBACKS):
            if not inbox:
                self._inbox = None
                return
            subscription, message = inbox.pop(0)
            subscription.waiting -= 1
            about = message.about
            about.counts.called += 1
            put(pack(now_ns, called, own, message.origin.id, message.seq, about.id))
            callback = subscription.callback
            callback(message)
        raise KernelError(f"more than {MAX_CALLBACKS} callbacks on {self.name} at {now_ns} ns: the "
                          f"loop goes through topic {about.name}")


@lru_cache  # an enum takes three calls
def _kinds(transport: str, via: str) -> tuple[TransportKind, Addressing]:
    return TransportKind(transport), Addressing(via)


def receive_all(message: Message, receivers: Sequence[int]) -> Sequence[int]:
    """``Host.receive`` at each of ``receivers``, which are in the order of their trace ids. Returns
    those where somebody listens."""
    graph, about = message.origin.graph, message.about
    hosts, end_at = graph.hosts, about.listening.get
    woken: list[Host] = []
    deaf: list[int] = []
    for receiver in receivers:
        end = end_at(receiver)
        if type(end) is PolledSubscription:
            end.put(message)
            continue
        host = hosts[receiver]
        if type(end) is Subscription and host._inbox is None:
            end.waiting = 1
            host._inbox = [(end, message)]
            woken.append(host)
        elif not host.receive(message):
            deaf.append(receiver)
    if woken:
        about.counts.queued += len(woken)
        graph.kernel.after_all(0, _CONTROL, [host.id for host in woken], _drain_all, woken)
    return [receiver for receiver in receivers if receiver not in deaf] if deaf else receivers


def _drain_all(hosts: Sequence[Host]) -> None:
    """``Host._drain`` at each of ``hosts``. The rows of one message's callbacks are written
    together."""
    message: Message | None = None
    called: list[bytes] = []
    try:
        for host in hosts:
            inbox = host._inbox
            if inbox is None or len(inbox) != 1:
                host._drain(None)
                continue
            subscription, waiting = inbox.pop()
            if waiting is not message:
                _record_called(message, called)
                message, called = waiting, []
            subscription.waiting -= 1
            called.append(host.packed_id)
            subscription.callback(waiting)
            if inbox:
                host._drain(None)
            else:
                host._inbox = None
    finally:
        _record_called(message, called)


def _record_called(message: Message | None, hosts: Sequence[bytes]) -> None:
    """The callbacks of ``message`` have been called at ``hosts``."""
    if message is None:
        return
    about, graph = message.about, message.origin.graph
    about.counts.called += len(hosts)
    graph.put(pack_each(graph.kernel.now_ns, graph.CALLBACK, hosts, message.origin.id, message.seq,
                        about.id))
