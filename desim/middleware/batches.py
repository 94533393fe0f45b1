"""Batches: what several publishers of one host publish in one instant, handled as one.

A driver publishes the scans of a whole fleet at once. Each would be a message of its own, a frame
of its own, an arrival of its own; nearly all of them are read much later or never. Here they are
one ``Batch``: the network model is asked once for all arrivals, a message is made when somebody
reads it, and trace rows and counts are written later, many batches at once.

Whatever is unusual goes the ordinary way, message by message: publishers with several receivers,
rules that have something to say, a link whose last message has not arrived, a frame that is lost, a
host that stops. What happens is the same, row by row.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, NamedTuple, Protocol, runtime_checkable

import numpy as np

from desim.engine.kernel import Phase, pair
from desim.engine.trace import ROW
from desim.middleware.contents import Lazy
from desim.middleware.message import Message
from desim.middleware.transports import StreamLink, stream_frame
from desim.network.carrier import Carrier
from desim.network.medium import UNKNOWN_NS, Medium

if TYPE_CHECKING:
    from desim.middleware.host import Host
    from desim.middleware.topics import Publisher


class Batch:
    """Messages that were born at ``born_ns``. Message i has number ``seq + i`` among its host's and
    ``number + i`` among the run's, and arrives at ``arrivals[i]`` ns; ``read(k)`` computes the
    content of publisher k's. ``open`` are those that still have to be counted as delivered; it is
    the ``ordinal``-th batch of its publishers."""

    __slots__ = ("born_ns", "seq", "number", "ordinal", "arrivals", "read", "sent", "open")

    def __init__(self, born_ns: int, seq: int, number: int, ordinal: int, count: int,
                 read: Callable[[int], object]) -> None:
        self.born_ns, self.seq, self.number, self.ordinal = born_ns, seq, number, ordinal
        self.arrivals = [UNKNOWN_NS] * count
        self.read = read
        self.sent = False  # counted as sent
        self.open = dict.fromkeys(range(count))


class BatchArrivals(NamedTuple):
    """Messages of one host that were delivered: the host, their size, and arrays of their numbers,
    trace ids of their topics, receiving hosts, births (when their frames were sent, too) and
    arrivals."""

    source: int
    size_bytes: int
    numbers: np.ndarray
    topics: np.ndarray
    receivers: np.ndarray
    born_ns: np.ndarray
    arrived_ns: np.ndarray


@runtime_checkable
class TakesArrivals(Protocol):
    """A listener to the fates of messages that takes many at once."""

    def arrivals(self, batch: BatchArrivals) -> object:
        """All of these messages were delivered."""


class Member(Carrier[Batch]):
    """One publisher's place in its batches: the link to its one receiver. ``latest`` keeps the
    messages there; None: a callback waits for each. It is the carrier of the publisher's frames."""

    protocol = "tcp"
    __slots__ = ("publisher", "link", "host", "latest", "ahead", "index", "_batches", "_number",
                 "_entity", "_elsewhere")

    def __init__(self, batches: BatchPublisher, index: int, number: int, link: StreamLink,
                 publisher: Publisher, host: Host) -> None:
        self.publisher, self.link, self.host = publisher, link, host
        latest = host.latest_without_callbacks(publisher.topic.name)
        self.latest = None if latest is None or latest.wakes else latest
        self.ahead = True
        self._batches, self.index, self._number = batches, index, number
        self._entity = pair(publisher.host.id, host.id)
        self._elsewhere = batches.published  # batches of before, and messages that links have had

    @property
    def socket(self) -> object:
        return self.link.socket

    def expected(self, batch: Batch, receiver: int, arrival_ns: int) -> None:
        if self.index in batch.open:
            batch.arrivals[self.index] = arrival_ns
            if self.latest is None:
                self.await_(batch, arrival_ns)
        else:
            self.link.expected(self.message(batch), receiver, arrival_ns)

    def await_(self, batch: Batch, arrival_ns: int) -> None:
        """Book the arrival of a message, for a callback that waits for it."""
        self._batches.kernel.at(arrival_ns, Phase.DELIVER, self._entity, self._hand_over, batch)

    def _hand_over(self, batch: Batch) -> None:
        if batch.arrivals[self.index] != UNKNOWN_NS:
            self.host.receive(self.message(batch))

    def message(self, batch: Batch) -> Message:
        """This publisher's message."""
        index, size_bytes = self.index, self._batches.size_bytes
        message = Message(self.publisher.host, self.publisher.topic, batch.seq + index, size_bytes,
                          batch.born_ns, Lazy(size_bytes, partial(batch.read, self._number)))
        message.number = batch.number + index
        return message

    def newer(self, known: Message | None) -> Message | None:
        """The last message that has arrived, unless it is ``known`` or older."""
        batches, index = self._batches, self.index
        batch = batches.last
        if batch is None:
            return None
        arrival_ns = batch.arrivals[index]
        if arrival_ns >= batches.kernel.now_ns and not batches.kernel.over(arrival_ns,
                                                                           Phase.DELIVER):
            # A batch sets out when the one before has arrived, or links have taken that over.
            batch = batches.before
            if batch is None or batch.arrivals[index] == UNKNOWN_NS:
                return None
        if known is not None and batch.seq + index <= known.seq:
            return None
        return self.message(batch)

    @property
    def size_bytes(self) -> int:
        return self._batches.size_bytes

    def landed(self) -> int:
        """The number of messages that have arrived in batches."""
        batch, kernel = self._batches.last, self._batches.kernel
        if batch is not None:
            arrival_ns = batch.arrivals[self.index]
            if arrival_ns >= kernel.now_ns and not kernel.over(arrival_ns, Phase.DELIVER):
                batch = self._batches.before
        return 0 if batch is None else batch.ordinal - self._elsewhere

    def give(self, batch: Batch) -> Message:
        """Hand the message, which is on its way, over to the link."""
        if self.latest is not None:
            self.latest.catch_up()
        message = self.message(batch)
        del batch.open[self.index]
        batch.arrivals[self.index] = UNKNOWN_NS
        self._elsewhere += 1
        self._batches.mixed = True
        self.link.take(message)
        return message

    # Unusual fates.

    def arrived(self, batch: Batch, receiver: int) -> None:
        self.link.arrived(self._given(batch), receiver)

    def arrived_in_part(self, batch: Batch, receiver: int, lost: dict[int, str]) -> None:
        self.link.arrived_in_part(self._given(batch), receiver, lost)

    def lost(self, batch: Batch, receiver: int, reason: str) -> None:
        self.link.lost(self._given(batch), receiver, reason)

    def repeated(self, batch: Batch, receiver: int) -> None:
        self.link.repeated(self.message(batch), receiver)

    def _given(self, batch: Batch) -> Message:
        if self.index not in batch.open:
            return self.message(batch)
        self._batches.catch_up()  # the link waits by the round trips that were measured so far
        return self.give(batch)


@dataclass(frozen=True, slots=True)
class _Route:
    """The members and the medium of a batch, and what all its rows have in common."""

    members: list[Member]
    medium: Medium
    receivers: tuple[int, ...]
    topics: np.ndarray  # ids
    hosts: np.ndarray  # ids of the receivers
    awaited: list[Member]  # by callbacks

    def __getitem__(self, index: int) -> Member:
        return self.members[index]

    def expected_many(self, batch: Batch, delays_ns: Sequence[int]) -> None:
        """See ``Carriers``."""
        now_ns, arrivals = batch.born_ns, batch.arrivals
        arrivals[:len(delays_ns)] = [now_ns + delay_ns for delay_ns in delays_ns]
        for member in self.awaited:
            arrival_ns = arrivals[member.index]
            if arrival_ns != UNKNOWN_NS:
                member.await_(batch, arrival_ns)


class BatchPublisher:
    """Publishers of one host that always publish in one instant, messages of ``size_bytes``.
    ``last`` and ``before`` are the last two batches."""

    def __init__(self, publishers: Sequence[Publisher], size_bytes: int) -> None:
        self._publishers = list(publishers)
        self.host = publishers[0].host
        self._graph = self.host.graph
        self.kernel = self._graph.kernel
        self.size_bytes = size_bytes
        self.mixed = False  # links may have messages of their own
        self.published = 0  # batches, so far
        self._frame = stream_frame(size_bytes)
        self._connections = -1  # of the graph, when the route was found
        self._route: _Route | None = None
        self._batches: list[Batch] = []  # with something that is not counted yet
        self.before: Batch | None = None
        self.last: Batch | None = None
        self._graph.batches.append(self)

    def publish(self, read: Callable[[int], object]) -> None:
        """Publish one message of each publisher that has subscribers; ``read(k)`` computes the
        content of publisher k's."""
        graph, host = self._graph, self.host
        if self._connections != graph.connections:
            self._connect()
        route = self._route
        if route is None or not self._is_free(route) or not route.medium.lets_pass(
                host.index, route.receivers, *self._frame):
            self._publish_singly(read)
            return
        count = len(route.members)
        self.published += 1
        batch = Batch(self.kernel.now_ns, host.published + 1, graph.messages + 1, self.published,
                      count, read)
        host.published += count
        graph.messages += count
        self._batches.append(batch)
        self.before, self.last = self.last, batch
        route.medium.transmit_many(host.index, route.receivers, *self._frame, route, batch)

    def release(self) -> None:
        """Hand messages on their way over to their links: what follows may change their fate."""
        last, over = self.last, self.kernel.over
        if last is None or self._route is None or not last.open:
            return
        self.catch_up()  # links wait by the round trips that were measured so far
        for index in tuple(last.open):
            arrival_ns = last.arrivals[index]
            if not over(arrival_ns, Phase.DELIVER):
                member = self._route.members[index]
                message = member.give(last)
                if arrival_ns != UNKNOWN_NS:
                    member.link.await_(message, arrival_ns)

    def catch_up(self) -> None:
        """Write the rows of what has happened by now, and count it."""
        route, batches = self._route, self._batches
        if not batches or route is None:
            return
        unsent = [batch for batch in batches if not batch.sent]
        if unsent:
            self._count_sent(route, unsent)
        arrivals = np.array([batch.arrivals for batch in batches])
        landed = arrivals <= self.kernel.last_over_ns(Phase.DELIVER)
        for k, batch in enumerate(batches):
            if len(batch.open) < landed.shape[1]:
                landed[k] &= np.isin(np.arange(landed.shape[1]), list(batch.open))
            if landed[k].all():
                batch.open.clear()
            for index in np.flatnonzero(landed[k]).tolist() if batch.open else ():
                del batch.open[index]
        if landed.any():
            self._count_arrived(route, batches, arrivals, landed)
        self._batches = [batch for batch in batches if batch.open]

    def _connect(self) -> None:
        """Find the way of the next batches, which may be none."""
        self.release()
        self.catch_up()
        for member in self._route.members if self._route is not None else ():
            if member.latest is not None:
                member.latest.take_from(None)
        self._route = self.before = self.last = None
        self.mixed = True
        members = self._members()
        self._connections = self._graph.connections
        if not members:
            return
        media = [self._graph.routes.of(self.host, member.host.index, member.publisher.topic.name)
                 for member in members]
        medium = media[0]
        if not isinstance(medium, Medium) or any(other is not medium for other in media):
            return
        self._route = _Route(
            members, medium, tuple(member.host.index for member in members),
            np.array([member.publisher.topic.id for member in members], np.int64),
            np.array([member.host.id for member in members], np.int64),
            [member for member in members if member.latest is None])
        for member in members:
            if member.latest is not None:
                member.latest.take_from(member)

    def _members(self) -> list[Member]:
        """The publishers with subscribers; none where they cannot publish in batches."""
        members: list[Member] = []
        for number, publisher in enumerate(self._publishers):
            if not publisher.has_subscribers():
                continue
            link = publisher.only_link()
            if not isinstance(link, StreamLink) or self._graph.payloads != "lazy":
                return []
            members.append(Member(self, len(members), number, link, publisher, link.host))
        return members

    def _is_free(self, route: _Route) -> bool:
        """Whether each link can send at once."""
        last = self.last
        if last is not None and last.open:
            latest_ns = (max(last.arrivals) if len(last.open) == len(last.arrivals)
                         else max(last.arrivals[index] for index in last.open))
            if not self.kernel.over(latest_ns, Phase.DELIVER):
                return False
        if self.mixed and not all(member.link.is_idle for member in route.members):
            return False
        self.mixed = False
        return True

    def _publish_singly(self, read: Callable[[int], object]) -> None:
        self.release()
        self.mixed = True
        for number, publisher in enumerate(self._publishers):
            if publisher.has_subscribers():
                publisher.publish(Lazy(self.size_bytes, partial(read, number)))

    def _count_sent(self, route: _Route, batches: list[Batch]) -> None:
        """Write the rows ``sent`` and ``frame`` of batches."""
        graph, count, own = self._graph, len(route.members), self.host.id
        seqs, born_ns = _of(batches, "seq")[:, None] + np.arange(count), _of(batches, "born_ns")
        graph.trace.put_rows(_rows(born_ns[:, None], graph.SENT, own, route.topics, seqs,
                                   self.size_bytes))
        graph.trace.put_rows(_rows(born_ns[:, None], graph.FRAME, own, route.hosts, seqs,
                                   self._frame[0]))
        for batch in batches:
            batch.sent = True
        for member in route.members:
            member.publisher.topic.counts.intended += len(batches)

    def _count_arrived(self, route: _Route, batches: list[Batch], arrivals: np.ndarray,
                       landed: np.ndarray) -> None:
        """Write the rows ``delivered`` of the messages that have ``landed`` [batches, members]."""
        graph, own = self._graph, self.host
        born_ns = _of(batches, "born_ns")[:, None]
        latencies = arrivals - born_ns
        seqs = _of(batches, "seq")[:, None] + np.arange(len(route.members))
        graph.trace.put_rows(_rows(arrivals, graph.DELIVERED, route.hosts, own.id, seqs,
                                   latencies)[landed.ravel()])
        columns = ([column[own_landed].tolist() for column, own_landed
                    in zip(latencies.T, landed.T, strict=True)]
                   if not landed.all() else latencies.T.tolist())
        first_ns = np.where(landed, arrivals, UNKNOWN_NS).min(axis=0).tolist()
        last_ns = np.where(landed, arrivals, 0).max(axis=0).tolist()
        for index, (member, mine) in enumerate(zip(route.members, columns, strict=True)):
            if mine:
                counts = member.publisher.topic.counts
                counts.bytes += len(mine) * self.size_bytes
                counts.latency.extend(mine)
                member.link.note_trip(min(mine))
                own.has_arrived(member.host.index, first_ns[index], last_ns[index])
        route.medium.flights.landed_each(route.receivers, *self._frame, list(map(len, columns)))
        if graph.on_arrivals is not None:
            numbers = _of(batches, "number")[:, None] + np.arange(len(route.members))
            graph.on_arrivals(BatchArrivals(own.index, self.size_bytes, *(
                np.broadcast_to(values, landed.shape)[landed] for values in (
                    numbers, route.topics, np.array(route.receivers), born_ns, arrivals))))
        elif graph.on_fate is not None:
            for k, index in np.argwhere(landed).tolist():
                member, batch = route.members[index], batches[k]
                graph.on_fate(member.message(batch), member.host.index, batch.arrivals[index],
                              None, batch.born_ns, batch.born_ns)


def _of(batches: list[Batch], field: str) -> np.ndarray:
    return np.array([getattr(batch, field) for batch in batches], np.int64)


def _rows(t_ns: np.ndarray, kind: int, entity: int | np.ndarray, a: int | np.ndarray,
          b: np.ndarray, c: int | np.ndarray) -> np.ndarray:
    """Trace rows of all messages of some batches."""
    rows = np.empty(b.shape, ROW)
    rows["t_ns"], rows["kind"], rows["entity"] = t_ns, kind, entity
    rows["a"], rows["b"], rows["c"] = a, b, c
    return rows.ravel()
