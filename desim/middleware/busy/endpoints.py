"""Publishers and subscriptions on a host whose callbacks take time."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from desim.engine.trace import pack
from desim.middleware.busy.executor import Executor
from desim.middleware.contents import Content
from desim.middleware.message import Message
from desim.middleware.topics import PolledSubscription, Publisher, Subscription, Topic, WaitSet
from desim.ports.middleware import Addressing, Advertisement

if TYPE_CHECKING:
    from desim.middleware.batches.batch import Member
    from desim.middleware.busy.host import BusyHost
    from desim.middleware.transports import StreamLink


class QueuedSubscription(Subscription):
    """A subscription whose messages wait until its node is free. A new message takes the turn of
    the one that it overwrites (ros_comm, subscription.cpp: a full queue adds no callback)."""

    __slots__ = ("trigger", "cost_ns", "host", "_host_id", "_graph", "_executor", "_messages")
    wants_end = False  # the next message has its own turn

    def __init__(self, host: BusyHost, executor: Executor, topic: Topic,
                 callback: Callable[[Message], object], limit: int) -> None:
        super().__init__(topic, callback, limit)
        self.trigger = host.graph.without_hosts(topic.name)
        self.cost_ns = executor.cost_of(self.trigger)
        self.host, self._host_id, self._graph = host, host.id, host.graph
        self._executor = executor
        self._messages: list[Message] = []

    def put(self, message: Message) -> None:
        """``message`` has arrived."""
        executor, messages = self._executor, self._messages
        executor.owed_ns += executor.receive_ns(self.trigger, message.size_bytes)
        messages.append(message)
        if 0 < self.limit < len(messages):
            self.host.overwritten(messages.pop(0))
        else:
            executor.add(self)
            if executor.over or not executor.awaited:  # else its end is an event
                self.host.wake(executor)

    def waiting_bytes(self) -> int:
        """The bytes of the messages that wait."""
        return sum([message.size_bytes for message in self._messages]) if self._messages else 0

    def discard(self) -> None:
        """The host stops."""
        self.topic.counts.discarded += len(self._messages)
        self._messages.clear()

    def run(self) -> int:
        message, graph, about = self._messages.pop(0), self._graph, self.topic
        about.counts.called += 1
        graph.put(pack(graph.kernel.now_ns, graph.CALLBACK, self._host_id, message.origin.id,
                       message.seq, about.id))
        self.callback(message)
        return message.size_bytes

    def ended(self) -> None:
        """Do nothing: each message has its own turn."""


class BusyPolledSubscription(PolledSubscription):
    """A subscription without a callback. Each message that arrives costs each node that reads the
    topic (``readers``) time."""

    __slots__ = ("trigger", "readers", "_paid")

    def __init__(self, host: BusyHost, topic: str, wait_set: WaitSet | None) -> None:
        super().__init__(host, wait_set)
        self.trigger = host.graph.without_hosts(topic)
        self.readers: list[Executor] = []
        self._paid = 0  # messages of the present feed that readers have been charged for

    def read_by(self, executor: Executor) -> None:
        """The node of ``executor`` reads the topic from now on."""
        self.charge_readers()
        if executor not in self.readers:
            self.readers.append(executor)
        self._mark_uncharged()

    def charge_readers(self) -> bool:
        """Charge the readers for what has arrived by now. Returns whether more messages may arrive
        without an event, as those of a feed do."""
        if self._expected:
            self.catch_up()
        feed = self.feed
        if feed is None:
            return bool(self._expected)
        landed = feed.landed()
        if landed > self._paid:
            fresh, self._paid = landed - self._paid, landed
            trigger, size_bytes = self.trigger, feed.size_bytes
            for executor in self.readers:
                executor.owed_ns += fresh * executor.receive_ns(trigger, size_bytes)
        return True

    def take_from(self, feed: Member | None) -> None:
        self.charge_readers()
        super().take_from(feed)
        self._paid = 0
        self._mark_uncharged()

    def expect(self, link: StreamLink, message: Message, due_ns: int) -> None:
        super().expect(link, message, due_ns)
        self._mark_uncharged()

    def put(self, message: Message) -> None:
        super().put(message)
        self._charge(message)

    def catch_up(self) -> None:
        waiting = tuple(self._expected)
        super().catch_up()
        for _, _, message in waiting[:len(waiting) - len(self._expected)]:
            self._charge(message)

    def _charge(self, message: Message) -> None:
        trigger, size_bytes = self.trigger, message.size_bytes
        for executor in self.readers:
            executor.owed_ns += executor.receive_ns(trigger, size_bytes)

    def _mark_uncharged(self) -> None:
        """Messages may arrive without an event: readers ask for them before their callbacks."""
        for executor in self.readers:
            executor.uncharged[self] = None


class HeldPublisher(Publisher):
    """A publisher whose messages leave when the time of the callback that publishes them is
    over."""

    __slots__ = ("_busy_host", "_name", "_newest_bytes", "_is_at_rest", "_links",
                 "_connections")

    def __init__(self, host: BusyHost, topic: Topic, advertised: Advertisement) -> None:
        super().__init__(host, topic, advertised)
        self._busy_host = host
        self._name = host.graph.without_hosts(topic.name)
        self._newest_bytes = 0  # of the message that a callback published last
        self._is_at_rest = False  # all had arrived, and none has left for another host since
        self._links = 0  # over which a message would go
        self._connections = -1  # of the graph, when they were counted

    def publish(self, content: Content) -> None:
        host = self._busy_host
        calling = host.calling
        if calling is None:  # the node starts, or is a driver
            self._is_at_rest = False
            super().publish(content)
            return
        if self._connections != host.graph.connections:
            self._count_links()
        calling.held.append((self, content))
        if self._links:
            calling.owed_ns += calling.send_ns(self._name, content.size_bytes, self._links)

    def release(self, content: Content) -> None:
        """The callback that published ``content`` is over: send it."""
        self._newest_bytes = content.size_bytes
        Publisher.publish(self, content)  # ``super()`` costs as much as two calls
        if self._receivers:
            self._is_at_rest = False

    def waiting_bytes(self) -> int:
        """The bytes of the messages that have not arrived, each as large as the newest."""
        if self._is_at_rest or not self._newest_bytes:
            return 0
        waiting = self.waiting()
        self._is_at_rest = not waiting and not self.latch  # it sends to new subscribers by itself
        return self._newest_bytes * waiting

    def _count_links(self) -> None:
        """Count the connections over which a message would go now."""
        if self._stale:
            self._refresh()
        self._links = len(self._receivers)
        if self._links > 1 and self.advertised.via is Addressing.BROADCAST:
            self._links = 1
        if self._local:
            self._links += self._busy_host.readers(self.topic.name)
        self._connections = self._busy_host.graph.connections
