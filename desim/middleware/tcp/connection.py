"""A connection, as its users see it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from desim.middleware.tcp.end import ESTABLISHED, End
from desim.middleware.tcp.transit import FIN, Token

if TYPE_CHECKING:
    from desim.middleware.tcp.sender import Sender
    from desim.middleware.tcp.stack import Tcp
    from desim.ports.middleware import Route

Closed = Callable[["Connection", str], object]


class Numbered(Protocol):
    """A message of ``topic``. ``seq`` is its number in trace rows."""

    @property
    def topic(self) -> str: ...
    @property
    def seq(self) -> int: ...


M = TypeVar("M", bound=Numbered)


class StreamMessage(Generic[M]):
    """A message as data of a connection. ``first_ns`` and ``last_ns`` are when the first and the
    last frame with bytes of it were sent (below 0: none yet)."""

    __slots__ = ("message", "seq", "first_ns", "last_ns")

    def __init__(self, message: M, first_ns: int = -1, last_ns: int = -1) -> None:
        self.message = message
        self.seq = message.seq
        self.first_ns, self.last_ns = first_ns, last_ns

    @property
    def topic(self) -> str:
        return self.message.topic


class Connection:
    """A TCP connection from ``client`` to ``service`` on ``server``; its ``number`` is above those
    of all earlier ones.

    ``open`` from the moment that the client knows so, until one end closes it or finds it dead (a
    host that stops sends nothing) or both have stopped. ``about`` is for its owner. Hosts are given
    as indices, each of them one of the two ends.
    """

    __slots__ = ("tcp", "number", "client", "server", "service", "kind", "nodelay", "keepalive",
                 "medium", "open", "about", "ends")

    def __init__(self, tcp: Tcp, number: int, client: int, server: int, service: str, kind: str,
                 medium: Route | None, nodelay: bool, keepalive: bool) -> None:
        self.tcp = tcp
        self.number = number
        self.client, self.server = client, server
        self.service = service
        self.kind = kind
        self.nodelay, self.keepalive = nodelay, keepalive
        self.medium = medium
        self.open = False
        self.about: Token = None
        self.ends = near, far = End(self, client, server), End(self, server, client)
        near.join(far)
        far.join(near)

    def send(self, source: int, size_bytes: int, arrived: Callable[..., object],
             token: Token = None, kind: str | None = None, writes: int = 1) -> None:
        """Send a message of ``size_bytes`` (above 0, with its framing) from host ``source``.
        ``arrived(token)`` is called when all of it is at the other end, after all earlier messages.
        Its bytes are discovery of ``kind``; without one they are data, ``token`` is a
        ``StreamMessage``. Before the connection is open, it waits. Without Nagle's algorithm each
        of several ``writes`` is a packet of its own."""
        self.ends[source != self.client].sender.send(size_bytes, arrived, token, kind,
                                                     writes if self.nodelay else 1)

    def sender(self, source: int) -> Sender:
        """The socket of ``source``: ``send`` as above, ``writable`` and ``when_writable``."""
        return self.ends[source != self.client].sender

    def on_closed(self, host: int, fn: Closed) -> None:
        """Call ``fn(connection, reason)`` when ``host`` learns of its end: by ``fin`` (orderly, the
        peer takes nothing more), ``reset``, ``timeout``, and at the client ``refused`` or
        ``unreachable``. At most once, and not if this host has closed it itself."""
        self.end(host).closed = fn

    def close(self, host: int) -> None:
        """Close ``host``'s end: written data is still sent, arriving data is refused."""
        self.end(host).close()

    def holds(self, host: int) -> bool:
        """Whether ``host`` takes the connection for open."""
        return self.end(host).state == ESTABLISHED

    def unacked(self, source: int) -> list[Token]:
        """Tokens of the messages of ``source`` that were not acknowledged."""
        messages = self.end(source).sender.transit.messages
        return [entry[2] for entry in messages if entry[3] is not FIN]

    def undelivered(self, source: int) -> list[Token]:
        """Those of them that have not arrived. When the connection is over at ``source``, none of
        these ever will; they are forgotten after ``on_closed``."""
        return self.unacked(source)[self.end(source).sender.transit.delivered:]

    def end(self, host: int) -> End:
        return self.ends[host != self.client]
