"""The two ends of a topic on a host: publishers and subscriptions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from operator import attrgetter, itemgetter
from typing import TYPE_CHECKING

from desim.engine.kernel import Phase
from desim.engine.trace import pack
from desim.middleware.answer_checks import subscribers_of
from desim.middleware.batches.publisher import BatchPublisher, FanOut
from desim.middleware.contents import Content
from desim.middleware.counts import Tallies, TopicCounts
from desim.middleware.inside import WithInside
from desim.middleware.message import Message
from desim.middleware.transports import Stream, StreamLink
from desim.ports.middleware import Addressing, Advertisement, Transport

if TYPE_CHECKING:
    from desim.middleware.batches.batch import Member
    from desim.middleware.host import Host


class Topic:
    """A name that messages are published under, its trace id, and its counts with their ``place``
    in the tallies. ``listening``: hosts that subscribe, known or not, with the end of the topic
    there; None: there are several. ``latest``: the ends of hosts on which no callback waits for its
    messages."""

    __slots__ = ("name", "id", "place", "counts", "publishers", "listening", "latest")

    def __init__(self, name: str, id_: int, tallies: Tallies) -> None:
        self.name = name
        self.id = id_
        self.place = tallies.join()
        self.counts = TopicCounts(tallies, self.place)
        self.publishers: list[Publisher] = []
        self.listening: dict[int, Subscription | PolledSubscription | None] = {}
        self.latest: dict[int, PolledSubscription] = {}

    def listens(self, host: int, latest: PolledSubscription | None,
                subscriptions: Sequence[Subscription]) -> None:
        """``host`` has these ends from now on."""
        before = host in self.listening
        if latest is None and not subscriptions:
            del self.listening[host]
        else:
            ends = *subscriptions, *(() if latest is None else (latest,))
            self.listening[host] = ends[0] if len(ends) == 1 else None
        self.latest.pop(host, None)
        if latest is not None and not subscriptions:
            self.latest[host] = latest
        if before != (host in self.listening):
            for publisher in self.publishers:
                publisher.count_unmatched()


class Subscription:
    """One callback of one node. ``limit`` messages may wait (0: any number)."""

    __slots__ = ("topic", "callback", "limit", "waiting", "_own")

    def __init__(self, topic: Topic, callback: Callable[[Message], object], limit: int) -> None:
        self.topic = topic
        self.callback = self._own = callback
        self.limit = limit
        self.waiting = 0

    def hold(self, held: list[tuple[Callable[..., object], object]] | None) -> None:
        """Keep the last ``limit`` messages in ``held``, with the callback that they are for; None:
        stop that."""
        def keep(message: Message) -> None:
            assert held is not None
            own = [entry for entry in held if entry[0] is self._own]
            if 0 < self.limit <= len(own):
                held.remove(own[0])
                self.topic.counts.overwritten += 1
            held.append((self._own, message))

        self.callback = self._own if held is None else keep


class PolledSubscription:
    """A subscription without a callback: the newest message waits here until its node reads it, as
    in a node that spins at its own rate (ros::spinOnce with a queue of one). Messages are put here
    when they arrive, or taken from the ``feed`` at a reading.

    When the message of another host is read first, that is a trace row ``read``, with the fields of
    a ``callback``. ``wait_set`` is notified.
    """

    __slots__ = ("feed", "number", "host", "_message", "_unread", "_expected", "_ready")

    def __init__(self, host: Host, wait_set: WaitSet | None = None) -> None:
        self.feed: Member | None = None
        self.host = host
        self._message: Message | None = None
        self._unread = False
        self._expected: list[tuple[int, StreamLink, Message]] = []  # by time of arrival
        self._ready = None if wait_set is None else wait_set.ready
        self.number = 0 if wait_set is None else wait_set.join()

    def read(self) -> Message | None:
        """The last message that has arrived, or None. (As a property it would cost 450 instructions
        more, 1700 times a second in maze_30.)"""
        if self._expected:
            self.catch_up()
        elif self.feed is not None:  # ``catch_up`` without its call
            message = self.feed.newer(self._message)
            if message is not None:
                self._message, self._unread = message, True
        message = self._message
        if self._unread:
            self._unread = False
            if message is not None and message.number:  # it is read for the first time
                host = self.host
                graph = host.graph
                put = graph.put  # so read, it costs 100 instructions less
                put(pack(graph.kernel.now_ns, graph.READ, host.id, message.origin.id, message.seq,
                         message.about.id))
        return message

    def put(self, message: Message) -> None:
        """``message`` has arrived."""
        self._message, self._unread = message, True
        if self._ready is not None:
            self._ready[self] = None

    def expect(self, link: StreamLink, message: Message, due_ns: int) -> None:
        """``message`` will arrive over ``link`` at ``due_ns``."""
        self._expected.append((due_ns, link, message))
        if len(self._expected) > 1:
            self._expected.sort(key=itemgetter(0))
        self.host.graph.expecting[self] = None
        if self._ready is not None:
            self._ready[self] = None

    def catch_up(self) -> None:
        """Take what has arrived by now, in order of arrival."""
        if self.feed is not None:
            message = self.feed.newer(self._message)
            if message is not None:
                self._message, self._unread = message, True
        expected = self._expected
        if not expected:
            return
        kernel = self.host.graph.kernel
        over_ns = kernel.now_ns - 1
        if expected[-1][0] > over_ns:  # as seldom
            over_ns = kernel.last_over_ns(Phase.DELIVER)
        while expected and expected[0][0] <= over_ns:
            due_ns, link, message = expected.pop(0)
            self._message, self._unread = message, True
            link.land(message, due_ns)
        if not expected:
            self.host.graph.expecting.pop(self, None)

    def take_from(self, feed: Member | None) -> None:
        """From now on messages come from ``feed``, too."""
        self.catch_up()
        self.feed = feed
        if feed is not None and self._ready is not None:
            self._ready[self] = None

    def book(self) -> None:
        """Somebody waits now: make events of the arrivals that are still to come."""
        self.catch_up()
        if self.feed is not None:
            self.feed.release()
        expected, self._expected = self._expected, []
        self.host.graph.expecting.pop(self, None)
        for due_ns, link, message in expected:
            link.await_(message, due_ns)


class WaitSet:
    """The subscriptions of a node that may have something new, as rclcpp's of this name: it need
    not look at all of them."""

    __slots__ = ("ready", "_members")

    def __init__(self) -> None:
        self.ready: dict[PolledSubscription, None] = {}  # those that may have something new
        self._members = 0

    def join(self) -> int:
        """Take one more subscription. Returns its number."""
        self._members += 1
        return self._members

    def news(self) -> list[tuple[PolledSubscription, Message]]:
        """The subscriptions with a message that has arrived and was not read, and that message, in
        the order of subscribing."""
        ready, news = sorted(self.ready, key=_by_number), []
        self.ready.clear()
        for latest in ready:
            if latest._expected or latest.feed is not None:
                latest.catch_up()
                if latest._expected or latest.feed is not None:
                    self.ready[latest] = None
            if latest._unread and (message := latest.read()) is not None:
                news.append((latest, message))
        return news


_by_number = attrgetter("number")


class Publisher:
    """One node's right to publish one topic, with its connections to the hosts that listen.

    It asks the registries again only after a change of the topic.
    """

    __slots__ = ("host", "topic", "advertised", "transport", "latch", "batches", "_stream", "_send",
                 "_fans_out", "_last", "_local", "_inside", "_stale", "_receivers",
                 "_has_subscribers", "_unmatched", "_owed")

    def __init__(self, host: Host, topic: Topic, advertised: Advertisement) -> None:
        self.host = host
        self.topic = topic
        self.advertised = advertised
        self._inside = host.graph.routes.inside(host, topic.name) is not None
        self.transport: Transport = host.graph.context.transport(advertised)
        if self._inside:
            self.transport = WithInside(host.index, host.graph.context.default_transport(
                advertised._replace(via=Addressing.UNICAST)), self.transport)
        self.latch = advertised.latch
        self.batches: BatchPublisher | None = None  # of which it is one
        self._stream = self.transport if isinstance(self.transport, Stream) else None
        self._send: Callable[[Message], object] = self.transport.send  # to all receivers of now
        self._last: Content | None = None  # of a latched topic
        self._local = self._has_subscribers = self._fans_out = False
        self._stale = True
        self._receivers: dict[int, None] = {}
        self._unmatched: list[int] | None = None  # see ``_missed``; None: not counted, or stale
        self._owed: list[int] = []  # those of them that miss a latched topic's last message

    def stream_links(self) -> Mapping[int, StreamLink]:
        """The links by receiver over which its messages may go in batches; none if the topic is not
        its own alone, or it also publishes to its own host, or what it publishes is missed or
        latched."""
        stream = self._stream
        if stream is None or self._stale or len(self.topic.publishers) > 1 \
                or self._local or self.latch or self._missed():
            return {}
        return stream.links()

    def publish(self, content: Content) -> None:
        """Send ``content`` to all subscribers."""
        batches = self.batches
        if batches is None and self._fans_out:
            batches = FanOut(self, content.size_bytes)
        if batches is not None and batches.publish_alone(content):
            return
        unmatched = self._unmatched
        if unmatched is None:
            if self._stale:
                self._refresh()
            unmatched = self._missed()
        if unmatched:
            self.topic.counts.unmatched += len(unmatched)
        if self.latch:
            self._last = content
            self._owed = unmatched
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
            send = self._send
            send(message)

    def waiting(self) -> int:
        """Receptions under way: messages times receivers."""
        in_batches = 0 if self.batches is None else self.batches.waiting(self)
        return self.transport.waiting() + in_batches

    def has_subscribers(self) -> bool:
        if self._stale:
            self._refresh()
        return self._has_subscribers

    def changed(self) -> None:
        """The registries answer differently now: ask them again in this host's own turn."""
        if self.batches is not None:
            self.batches.disconnect()
        if not self._stale:
            self._stale, self._unmatched = True, None
            self.host.graph.kernel.after(0, Phase.CONTROL, self.host.id, self._refresh_if_stale)

    def count_unmatched(self) -> None:
        """The hosts that listen have changed, or those that are known to: the next message counts
        those that it misses. (Counted at each change, a fleet's start takes its size cubed.)"""
        if self.batches is not None:
            self.batches.disconnect()
        self._unmatched = None

    def _missed(self) -> list[int]:
        """The hosts of its domain that listen and are no receivers."""
        if self._unmatched is None:
            own, receivers, domains = self.host.index, self._receivers, self.host.graph.domains
            self._unmatched = [host for host in self.topic.listening if host not in receivers
                               and host != own and domains[host] == domains[own]]
        return self._unmatched

    def close(self, reason: str) -> None:
        """The host stopped: drop waiting messages for ``reason``."""
        self._stale = False
        self._local = self.latch = self._has_subscribers = self._fans_out = False
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
                                                                 self.advertised.publisher))
        self._local = not self._inside and hosts.pop(own, own) is None
        self._receivers = hosts
        self._has_subscribers = self._local or bool(hosts)
        self._fans_out = self._stream is not None and not self.latch and len(hosts) > 1
        self.count_unmatched()
        fresh = self.transport.connect(list(hosts))
        self._send = self.transport.send if self._stream is None else self._stream.sender()
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
