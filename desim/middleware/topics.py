"""The two ends of a topic on a host: publishers and subscriptions."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from desim.engine.kernel import Phase
from desim.middleware.answer_checks import subscribers_of
from desim.middleware.contents import Content
from desim.middleware.counts import TopicCounts
from desim.middleware.message import Message
from desim.ports.middleware import Offer

if TYPE_CHECKING:
    from desim.middleware.host import Host


class Topic:
    """A name that messages are published under, its trace id and its counts. ``listening``: hosts
    that subscribe, known or not."""

    __slots__ = ("name", "id", "counts", "publishers", "listening")

    def __init__(self, name: str, id_: int) -> None:
        self.name = name
        self.id = id_
        self.counts = TopicCounts()
        self.publishers: list[Publisher] = []
        self.listening: dict[int, None] = {}

    def listens(self, host: int, does: bool) -> None:
        """``host`` subscribes from now on, or not any more."""
        if does == (host in self.listening):
            return
        if does:
            self.listening[host] = None
        else:
            del self.listening[host]
        for publisher in self.publishers:
            publisher.count_unmatched()


class Subscription:
    """One callback of one node. ``limit`` messages may wait (0: any number)."""

    __slots__ = ("topic", "callback", "limit", "waiting")

    def __init__(self, topic: Topic, callback: Callable[[Message], object], limit: int) -> None:
        self.topic = topic
        self.callback = callback
        self.limit = limit
        self.waiting = 0


class Latest:
    """A subscription without a callback: the newest message waits here until its node reads it, as
    in a node that spins at its own rate (ros::spinOnce with a queue of one)."""

    __slots__ = ("message",)

    def __init__(self) -> None:
        self.message: Message | None = None


class Publisher:
    """One node's right to publish one topic, with its connections to the hosts that listen.

    It asks the registries again only after a change of the topic.
    """

    __slots__ = ("host", "topic", "offer", "transport", "latch", "_last", "_local", "_stale",
                 "_receivers", "_has_subscribers", "_unmatched", "_owed")

    def __init__(self, host: Host, topic: Topic, offer: Offer) -> None:
        self.host = host
        self.topic = topic
        self.offer = offer
        self.transport = host.graph.context.transport(offer)
        self.latch = offer.latch
        self._last: Content | None = None  # of a latched topic
        self._local = self._has_subscribers = False
        self._stale = True
        self._receivers: dict[int, None] = {}
        self._unmatched: list[int] = []  # hosts that listen and are no receivers
        self._owed: list[int] = []  # those of them that miss a latched topic's last message
        self.count_unmatched()

    def publish(self, content: Content) -> None:
        if self._stale:
            self._refresh()
        if self._unmatched:
            self.topic.counts.unmatched += len(self._unmatched)
        if self.latch:
            self._last = content
            self._owed = self._unmatched
        if not self._has_subscribers:
            return
        host = self.host
        host.published = seq = host.published + 1
        graph = host.graph
        message = Message(host, self.topic, seq, content.size_bytes, graph.kernel.now_ns, content)
        if graph.read_at_birth:
            message.content  # noqa: B018 - reading computes it
        if self._local:
            host.receive(message)
        if self._receivers:
            graph.depart(message, len(self._receivers))
            self.transport.send(message)

    def has_subscribers(self) -> bool:
        if self._stale:
            self._refresh()
        return self._has_subscribers

    def changed(self) -> None:
        """The registries answer differently now: ask them again in this host's own turn."""
        if not self._stale:
            self._stale = True
            self.host.graph.kernel.after(0, Phase.CONTROL, self.host.id, self._refresh_if_stale)

    def count_unmatched(self) -> None:
        """The hosts that listen have changed, or those that are known to."""
        own, receivers = self.host.index, self._receivers
        self._unmatched = [host for host in self.topic.listening
                           if host not in receivers and host != own]

    def close(self, reason: str) -> None:
        """The host stopped: drop waiting messages for ``reason``."""
        self._stale = False
        self._local = self.latch = self._has_subscribers = False
        self._receivers = {}
        self._unmatched = []
        self.transport.close(reason)

    def _refresh_if_stale(self, _: object) -> None:
        if self._stale:
            self._refresh()

    def _refresh(self) -> None:
        self._stale = False
        own = self.host.index
        hosts = dict.fromkeys(end.host for end in subscribers_of(self.host.graph.middleware,
                                                                 self.offer.publisher))
        self._local = hosts.pop(own, own) is None
        self._receivers = hosts
        self._has_subscribers = self._local or bool(hosts)
        self.count_unmatched()
        fresh = self.transport.connect(list(hosts))
        if fresh and self.latch and self._last is not None:
            self._repeat(self._last, fresh)

    def _repeat(self, last: Content, receivers: list[int]) -> None:
        """A latched topic's last message goes to every new connection."""
        host = self.host
        host.published += 1
        again = [receiver for receiver in receivers if receiver in self._owed]
        self._owed = [receiver for receiver in self._owed if receiver not in again]
        self.topic.counts.unmatched -= len(again)
        message = Message(host, self.topic, host.published, last.size_bytes,
                          host.graph.kernel.now_ns, last)
        host.graph.depart(message, len(receivers))
        self.transport.send(message, receivers)
