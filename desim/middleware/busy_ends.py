"""The two ends of a topic on a host whose callbacks take time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING

from desim.engine.trace import pack
from desim.middleware.contents import Content
from desim.middleware.executor import Executor
from desim.middleware.message import Message
from desim.middleware.topics import Feed, Latest, Publisher, Subscription, Topic, WaitSet
from desim.ports.middleware import Addressing, Offer

if TYPE_CHECKING:
    from desim.middleware.busy_host import BusyHost


class QueuedSubscription(Subscription):
    """A callback whose messages wait until its node is free. A new message takes the turn of the
    one that it overwrites (ros_comm, subscription.cpp: a full queue adds no callback)."""

    __slots__ = ("trigger", "_host", "_executor", "_messages")

    def __init__(self, host: BusyHost, executor: Executor, topic: Topic,
                 callback: Callable[[Message], object], limit: int) -> None:
        super().__init__(topic, callback, limit)
        self.trigger = host.graph.without_hosts(topic.name)
        self._host, self._executor = host, executor
        self._messages: deque[Message] = deque()

    def put(self, message: Message) -> None:
        """``message`` has arrived."""
        self._executor.receive(self.trigger, message.size_bytes)
        self.topic.counts.queued += 1
        self._messages.append(message)
        if 0 < self.limit < len(self._messages):
            self._host.overwritten(self._messages.popleft())
        else:
            self._executor.add(self)

    @property
    def node(self) -> str:
        """The node whose callback it is."""
        return self._executor.node

    def waiting_bytes(self) -> int:
        """The bytes of the messages that wait."""
        return sum(message.size_bytes for message in self._messages)

    def discard(self) -> None:
        """The host stops."""
        self.topic.counts.discarded += len(self._messages)
        self._messages.clear()

    @property
    def waits(self) -> bool:
        return False

    def run(self) -> int:
        message, graph = self._messages.popleft(), self._host.graph
        self.topic.counts.called += 1
        graph.put(pack(graph.kernel.now_ns, graph.CALLBACK, self._host.id, message.origin.id,
                       message.seq, message.about.id))
        self.callback(message)
        return message.size_bytes

    def over(self) -> None:
        """The next message has its own turn."""


class CountedLatest(Latest):
    """A subscription without a callback that counts what arrives: ``readers`` nodes pay for it."""

    __slots__ = ("trigger", "arrived", "arrived_bytes", "readers", "_counted", "_counted_of")

    def __init__(self, host: BusyHost, topic: str, wait_set: WaitSet | None) -> None:
        super().__init__(host, wait_set)
        self.trigger = host.graph.without_hosts(topic)
        self.arrived = self.arrived_bytes = self.readers = 0
        self._counted = 0  # of the messages of this feed
        self._counted_of: Feed | None = None

    def put(self, message: Message) -> None:
        super().put(message)
        self._count(1, message.size_bytes)

    @property
    def is_behind(self) -> bool:
        """Whether something may have come that is not counted."""
        return self.feed is not None or bool(self._expected)

    def catch_up(self) -> None:
        waiting = len(self._expected)
        super().catch_up()
        if len(self._expected) < waiting and self._message is not None:
            self._count(waiting - len(self._expected), self._message.size_bytes)
        self._count_landed()

    def count(self) -> None:
        """Count what has come by now. (A message of a feed is made when it is read.)"""
        if self._expected:
            self.catch_up()
        else:
            self._count_landed()

    def _count_landed(self) -> None:
        feed = self.feed
        if feed is None:
            return
        if feed is not self._counted_of:
            self._counted, self._counted_of = 0, feed
        landed = feed.landed()
        if landed > self._counted:
            self._count(landed - self._counted, feed.size_bytes)
            self._counted = landed

    def _count(self, messages: int, size_bytes: int) -> None:
        self.arrived += messages
        self.arrived_bytes += messages * size_bytes


class HeldPublisher(Publisher):
    """A publisher whose messages leave when the time of the callback is over that publishes
    them."""

    __slots__ = ("_busy_host", "_name", "_newest_bytes")

    def __init__(self, host: BusyHost, topic: Topic, offer: Offer) -> None:
        super().__init__(host, topic, offer)
        self._busy_host = host
        self._name = host.graph.without_hosts(topic.name)
        self._newest_bytes = 0  # of the message that was published last

    def publish(self, content: Content) -> None:
        calling = self._busy_host.calling
        self._newest_bytes = content.size_bytes
        if calling is None:  # the node starts, or is a driver
            super().publish(content)
        else:
            calling.hold(self, content, self._name, self._links())

    def release(self, content: Content) -> None:
        super().publish(content)

    def waiting_bytes(self) -> int:
        """The bytes of the messages that have not arrived, each as large as the newest."""
        return self._newest_bytes * self.transport.waiting() if self._newest_bytes else 0

    def _links(self) -> int:
        """The number of connections over which a message would go now."""
        if not self.has_subscribers():
            return 0
        local = self._busy_host.readers(self.topic.name) if self._local else 0
        remote = len(self._receivers)
        return local + (min(remote, 1) if self.offer.via is Addressing.BROADCAST else remote)
