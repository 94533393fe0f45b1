"""The queue of a link: messages of all topics in one order, behind one TCP connection."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING

from desim.middleware.message import Message
from desim.middleware.tcp import StreamMessage
from desim.middleware.zenoh.sizes import push_bytes

if TYPE_CHECKING:
    from desim.middleware.zenoh.link import RouterLink
    from desim.middleware.zenoh.publication import ZenohPublication
    from desim.ports.networks import Handle


class Push(StreamMessage[Message]):
    """A message on one link (Zenoh's Push), for the hosts ``to`` behind it. A ``gone`` one is for
    no host any more. ``first_ns`` and ``last_ns``: of its frames on all links so far."""

    __slots__ = ("publication", "to", "hops", "gone")

    def __init__(self, message: Message, publication: ZenohPublication, to: tuple[int, ...],
                 first_ns: int, last_ns: int, hops: int) -> None:
        super().__init__(message, first_ns, last_ns)
        self.publication = publication
        self.to = to
        self.hops = hops
        self.gone = False

    def drop(self, reason: str) -> None:
        if not self.gone:
            self.gone = True
            self.publication.dropped(self, reason)


class LinkQueue:
    """The messages that wait at a link. While the socket takes nothing, one batch is being written
    and further batches fill. A message that fits into none blocks the node that publishes it. It
    waits, and closes the link if there is no progress for too long; or it is dropped after a moment
    (zenoh pipeline.rs, push_network_message: the caller waits in both cases)."""

    def __init__(self, link: RouterLink) -> None:
        self._link = link
        self._connection, self._host = link.connection, link.host
        self._sender = link.connection.sender(link.host)
        self._context, self._constants = link.router.context, link.router.constants
        self._kernel = self._context.kernel
        self._writing: deque[tuple[Push, int]] = deque()
        self._filling: deque[tuple[Push, int]] = deque()
        self._bytes = 0  # of what fills
        self._most_bytes = (self._constants.batches - 1) * self._constants.batch_bytes
        self._waiting: deque[Push] = deque()
        self._moved_ns = 0
        self._closer: Handle | None = None
        self._asked = False
        self._flushed: Callable[[], object] | None = None

    def offer(self, push: Push) -> None:
        size_bytes = self._size(push)
        if self._flushed is not None:
            push.drop("link_closed")
        elif not self._writing and self._sender.takes:
            self._go(push, size_bytes)
        elif not self._writing:
            self._writing.append((push, size_bytes))
            self._ask()
        elif not self._waiting and self._fits(size_bytes):
            self._fill(push, size_bytes)
        else:
            self._wait(push, size_bytes)

    def pushes(self) -> list[Push]:
        """All pushes that have not arrived."""
        flying = [token for token in self._connection.undelivered(self._host)
                  if type(token) is Push]
        written = [push for push, _ in (*self._writing, *self._filling)]
        return flying + written + list(self._waiting)

    def flush(self, flushed: Callable[[], object]) -> None:
        """Take nothing more; call ``flushed()`` when the socket has all pushes that were written.
        Blocked pushes stay blocked."""
        self._flushed = flushed
        if not self._writing:
            flushed()

    def close(self, reason: str) -> None:
        for push in self.pushes():
            push.drop(reason)
        self._writing.clear()
        self._filling.clear()
        while self._waiting:
            self._unblock(self._waiting.popleft())
        if self._closer is not None:
            self._closer.cancel()
            self._closer = None

    def _go(self, push: Push, size_bytes: int) -> None:
        link = self._link
        link.sent_ns = self._kernel.now_ns
        self._sender.send(size_bytes, link.carried, push, None)

    def _fits(self, size_bytes: int) -> bool:
        return not self._filling or self._bytes + size_bytes <= self._most_bytes

    def _fill(self, push: Push, size_bytes: int) -> None:
        self._filling.append((push, size_bytes))
        self._bytes += size_bytes

    def _ask(self) -> None:
        if not self._asked:
            self._asked = True
            self._sender.when_writable(self._writable)

    def _writable(self) -> None:
        """The socket takes more."""
        self._asked = False
        while self._writing and self._sender.takes:
            self._go(*self._writing.popleft())
            if not self._writing:
                self._next_batch()
        if self._writing:
            self._ask()
        elif self._flushed is not None and not self._link.over:
            self._flushed()

    def _next_batch(self) -> None:
        """Write the batch that has filled first; waiting pushes fill others."""
        most_bytes = self._constants.batch_bytes
        while self._filling and (not self._writing or self._filling[0][1] <= most_bytes):
            push, size_bytes = self._filling.popleft()
            self._bytes -= size_bytes
            most_bytes -= size_bytes
            self._writing.append((push, size_bytes))
        while self._waiting and self._flushed is None:
            push = self._waiting[0]
            size_bytes = self._size(push)
            if self._writing and not self._fits(size_bytes):
                return
            self._moved_ns = self._context.now_ns
            self._unblock(self._waiting.popleft())
            if self._writing:
                self._fill(push, size_bytes)
            else:
                self._writing.append((push, size_bytes))

    def _size(self, push: Push) -> int:
        return push_bytes(push.message.size_bytes, self._constants.batch_bytes)

    def _wait(self, push: Push, size_bytes: int) -> None:
        context, constants = self._context, self._constants
        self._waiting.append(push)
        if push.publication.source == self._host:
            context.block(self._host, push.publication.node)
        if not push.publication.blocks:
            batches = -(-size_bytes // constants.batch_bytes)
            patience_ns = min(batches * constants.wait_before_drop_ns,
                              max(constants.wait_before_drop_ns,
                                  constants.wait_before_drop_fragments_ns))
            context.at(context.now_ns + patience_ns, self._host, self._late, push)
        elif self._closer is None:
            self._moved_ns = context.now_ns
            self._closer = context.at(context.now_ns + constants.wait_before_close_ns,
                                      self._host, self._stuck)

    def _late(self, push: Push) -> None:
        """Drop a push that is still waiting."""
        if push in self._waiting:
            self._waiting.remove(push)
            self._unblock(push)
            push.drop("congested")

    def _unblock(self, push: Push) -> None:
        """``push`` waits no more."""
        if push.publication.source == self._host:
            self._context.unblock(self._host, push.publication.node)

    def _stuck(self, _: object) -> None:
        self._closer = None
        context = self._context
        due_ns = self._moved_ns + self._constants.wait_before_close_ns
        if not any(push.publication.blocks for push in self._waiting):
            return
        if context.now_ns >= due_ns:
            self._link.router.part(self._link.peer)
        else:
            self._closer = context.at(due_ns, self._host, self._stuck)
