"""Publishers that send their messages in batches: see ``desim.middleware.batches``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from desim.engine.kernel import Phase
from desim.middleware.batches.batch import Batch, Member
from desim.middleware.batches.way import BatchWay
from desim.middleware.contents import Content
from desim.middleware.headers import stream_frame

if TYPE_CHECKING:
    from desim.middleware.topics import Publisher


class BatchPublisher:
    """Publishers of one host that always publish in one instant, messages of ``size_bytes``.
    ``last`` and ``before`` are the last two batches."""

    def __init__(self, publishers: Sequence[Publisher], size_bytes: int) -> None:
        self._publishers = list(publishers)
        for publisher in publishers:
            publisher.batches = self
        self.host = publishers[0].host
        self._graph = self.host.graph
        self.kernel = self._graph.kernel
        self.size_bytes = size_bytes
        self.mixed = False  # links may have messages of their own
        self.published = 0  # batches, so far
        self.frame = stream_frame(size_bytes)
        self._connections = -1  # of the graph, when the way was found
        self._way: BatchWay | None = None
        self._batches: list[Batch] = []  # with something that is not counted yet
        self.before: Batch | None = None
        self.last: Batch | None = None
        self._graph.batches.append(self)

    def publish(self, content: Callable[[int], Content]) -> None:
        """Publish one message of each publisher that has subscribers; ``content(k)`` is the content
        of publisher k's, and is asked for when somebody reads the message. (Messages that a
        callback holds back until its time is over go one by one.)"""
        if self.host.calling is not None or not self._publish(content):
            self.release()
            for number, publisher in enumerate(self._publishers):
                if publisher.has_subscribers():
                    publisher.publish(content(number))

    def publish_alone(self, content: Content) -> bool:
        """One of the publishers publishes by itself. Returns whether that went as a batch."""
        return False

    def _publish(self, content: Callable[[int], Content]) -> bool:
        """Publish a batch, if nothing stands in its way."""
        graph, host, kernel = self._graph, self.host, self.kernel
        if self._connections != graph.connections:
            self._connect()
        way = self._way
        if way is None or not self._is_free(way) or not way.medium.lets_pass(
                host.index, way.receivers, *self.frame):
            return False
        messages = len(way.publishers)
        self.published += 1
        batch = Batch(kernel.now_ns, kernel.round_of(Phase.DELIVER), host.published + 1,
                      graph.messages + 1, self.published, messages, len(way.members), content)
        host.published += messages
        graph.messages += messages
        self._batches.append(batch)
        self.before, self.last = self.last, batch
        way.medium.transmit_many(host.index, way.receivers, *self.frame, way, batch)
        return True

    def release(self) -> None:
        """Hand messages on their way over to their links: the caller is about to change their fate,
        or to read the links."""
        self.mixed = True
        self.catch_up()  # they wait by the round trips that were measured so far
        last, way = self.last, self._way
        if last is not None and way is not None and last.open:
            over_ns = last.over_ns(self.kernel)
            for index in [index for index in last.open if last.arrivals[index] > over_ns]:
                way.members[index].give(last)

    def catch_up(self) -> None:
        """Write the rows of what has happened by now, and count it."""
        way, batches = self._way, self._batches
        if not batches or way is None:
            return
        unsent = [batch for batch in batches if not batch.sent]
        if unsent:
            way.count_sent(unsent)
        kernel, arrivals = self.kernel, np.array([batch.arrivals for batch in batches])
        now_ns, over_ns = kernel.now_ns, kernel.last_over_ns(Phase.DELIVER)
        landed = arrivals <= np.array([
            [over_ns if batch.born_ns < now_ns else batch.over_ns(kernel)] for batch in batches])
        for batch, there in zip(batches, landed, strict=True):
            if len(batch.open) < len(there):
                open_ = np.zeros(len(there), np.bool_)
                open_[list(batch.open)] = True
                there &= open_
        for batch, there, whole in zip(batches, landed, np.logical_and.reduce(landed, 1),
                                       strict=True):
            if whole:
                batch.open.clear()
            for index in there.nonzero()[0].tolist() if batch.open else ():
                del batch.open[index]
        self._batches = [batch for batch in batches if batch.open]
        if landed.any():
            way.count_arrived(batches, arrivals, landed)

    def disconnect(self) -> None:
        """One of the publishers may have other receivers now: find the way of the next batch anew.
        """
        self._connections = -1

    def waiting(self, publisher: Publisher) -> int:
        """The receptions of messages of ``publisher`` on their way."""
        last, way = self.last, self._way
        if last is None or way is None or not last.open:
            return 0
        over_ns = last.over_ns(self.kernel)
        return sum(last.arrivals[index] > over_ns and way.members[index].publisher is publisher
                   for index in last.open)

    def _connect(self) -> None:
        """Find the way of the next batches; there may be none."""
        members = self._members()
        self._connections = self._graph.connections
        before = self._way.members if self._way is not None else []
        if before and [member.ends for member in members] == [member.ends for member in before]:
            return
        self.release()
        for member in before:
            if member.latest is not None:
                member.latest.take_from(None)
        self.before = self.last = None
        self._way = BatchWay.of(self.host, self.size_bytes, self.frame, members)
        for member in self._way.members if self._way is not None else []:
            if member.latest is not None:
                member.latest.take_from(member)

    def _members(self) -> list[Member]:
        """The members of the publishers with subscribers; none if these cannot publish in batches.
        """
        members: list[Member] = []
        messages = 0
        for number, publisher in enumerate(self._publishers):
            if not publisher.has_subscribers():
                continue
            links = publisher.stream_links()
            if not links or self._graph.payloads != "lazy":
                return []
            members += [Member(self, index, messages, number, link, publisher,
                               self._graph.hosts[receiver])
                        for index, (receiver, link) in enumerate(links.items(), len(members))]
            messages += 1
        return members

    def _is_free(self, way: BatchWay) -> bool:
        """Whether each link can send at once."""
        last = self.last
        if last is not None and last.open:
            latest_ns = (max(last.arrivals) if len(last.open) == len(last.arrivals)
                         else max(last.arrivals[index] for index in last.open))
            if latest_ns > last.over_ns(self.kernel):
                return False
        if self.mixed and not all(member.link.at_rest for member in way.members):
            return False
        self.mixed = False
        return True


class FanOut(BatchPublisher):
    """One publisher with several receivers, each of whose messages is a batch of its own, if it has
    the size of the first one."""

    def __init__(self, publisher: Publisher, size_bytes: int) -> None:
        super().__init__([publisher], size_bytes)

    def publish_alone(self, content: Content) -> bool:
        if content.size_bytes == self.size_bytes and self._publish(lambda _: content):
            return True
        self.release()
        return False
