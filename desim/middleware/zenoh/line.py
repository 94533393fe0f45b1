"""What waits to go over a link: messages of all topics in one order, behind one TCP connection."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

from desim.middleware.zenoh.sizes import push_bytes

if TYPE_CHECKING:
    from desim.middleware.topics import Message
    from desim.middleware.zenoh.link import Link
    from desim.middleware.zenoh.publication import Publication


class Parcel:
    """A message on one link, TCP's ``Cargo``, for the hosts ``to`` behind it; nobody any more when
    it is ``gone``. ``first_ns`` and ``last_ns``: of its frames on all links so far.
    """

    __slots__ = ("message", "publication", "to", "seq", "first_ns", "last_ns", "hops", "gone")

    def __init__(self, message: Message, publication: Publication, to: tuple[int, ...],
                 first_ns: int, last_ns: int, hops: int) -> None:
        self.message = message
        self.publication = publication
        self.to = to
        self.seq = message.seq
        self.first_ns, self.last_ns = first_ns, last_ns
        self.hops = hops
        self.gone = False

    def drop(self, reason: str) -> None:
        if not self.gone:
            self.gone = True
            self.publication.dropped(self, reason)


class Line:
    """A few batches may wait for the socket. What they have no room for waits at its publisher: a
    stream keeps its newest there, as many as its queue takes, and closes the link when nothing
    moves for too long; a datagram is dropped after a moment."""

    __slots__ = ("_link", "_connection", "_sender", "_host", "_context", "_kernel", "_params",
                 "_batches",
                 "_bytes", "_most_bytes", "_waiting", "_counts", "_moved_ns", "_closer", "_asked")

    def __init__(self, link: Link) -> None:
        self._link = link
        self._connection, self._host = link.connection, link.host
        self._sender = link.connection.sender(link.host)
        self._context, self._params = link.router.context, link.router.params
        self._kernel = self._context.graph.kernel
        self._batches: deque[tuple[Parcel, int]] = deque()
        self._bytes = 0
        self._most_bytes = self._params.batches * self._params.batch_bytes
        self._waiting: deque[Parcel] = deque()
        self._counts: dict[Publication, int] = {}
        self._moved_ns = 0
        self._closer: Any = None
        self._asked = False

    def offer(self, parcel: Parcel) -> None:
        size_bytes = push_bytes(parcel.message.size_bytes, self._params.batch_bytes)
        if not self._batches and self._sender.room:
            self._go(parcel, size_bytes)
        elif not self._waiting and self._fits(size_bytes):
            self._queue(parcel, size_bytes)
        else:
            self._wait(parcel)

    def parcels(self) -> list[Parcel]:
        """All that have not arrived."""
        flying = [token for token in self._connection.unheard(self._host) if type(token) is Parcel]
        return flying + [parcel for parcel, _ in self._batches] + list(self._waiting)

    def close(self, reason: str) -> None:
        for parcel in self.parcels():
            parcel.drop(reason)
        self._batches.clear()
        self._waiting.clear()
        if self._closer is not None:
            self._closer.cancel()
            self._closer = None

    def _go(self, parcel: Parcel, size_bytes: int) -> None:
        link = self._link
        link.sent_ns = self._kernel.now_ns
        self._sender.send(size_bytes, link.carried, parcel, None)

    def _fits(self, size_bytes: int) -> bool:
        return not self._batches or self._bytes + size_bytes <= self._most_bytes

    def _queue(self, parcel: Parcel, size_bytes: int) -> None:
        self._batches.append((parcel, size_bytes))
        self._bytes += size_bytes
        if not self._asked:
            self._asked = True
            self._sender.when_room(self._room)

    def _room(self) -> None:
        """The socket takes more."""
        self._asked = False
        while self._batches and self._sender.room:
            parcel, size_bytes = self._batches.popleft()
            self._bytes -= size_bytes
            self._go(parcel, size_bytes)
            self._refill()
        if self._batches and not self._asked:
            self._asked = True
            self._sender.when_room(self._room)

    def _refill(self) -> None:
        batch_bytes = self._params.batch_bytes
        while self._waiting:
            parcel = self._waiting[0]
            size_bytes = push_bytes(parcel.message.size_bytes, batch_bytes)
            if not self._fits(size_bytes):
                return
            self._moved_ns = self._context.now_ns
            self._forget(parcel)
            self._batches.append((parcel, size_bytes))
            self._bytes += size_bytes

    def _wait(self, parcel: Parcel) -> None:
        publication, counts = parcel.publication, self._counts
        context = self._context
        self._waiting.append(parcel)
        counts[publication] = counts.get(publication, 0) + 1
        if not publication.stream:
            context.at(context.now_ns + self._params.wait_before_drop_ns, self._host, self._late,
                       parcel)
            return
        if 0 < publication.limit < counts[publication]:
            oldest = next(one for one in self._waiting if one.publication is publication)
            self._forget(oldest)
            oldest.drop("outbox_full")
        if self._closer is None:
            self._moved_ns = context.now_ns
            self._closer = context.at(context.now_ns + self._params.wait_before_close_ns,
                                      self._host, self._stuck)

    def _late(self, parcel: Parcel) -> None:
        """A datagram has waited long enough, if it waits still."""
        if parcel in self._waiting:
            self._forget(parcel)
            parcel.drop("congested")

    def _forget(self, parcel: Parcel) -> None:
        """It waits no longer."""
        self._waiting.remove(parcel)
        self._counts[parcel.publication] -= 1

    def _stuck(self, _: Any) -> None:
        self._closer = None
        context = self._context
        due_ns = self._moved_ns + self._params.wait_before_close_ns
        if not any(parcel.publication.stream for parcel in self._waiting):
            return
        if context.now_ns >= due_ns:
            self._link.close()
        else:
            self._closer = context.at(due_ns, self._host, self._stuck)
