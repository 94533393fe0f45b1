"""One end of a link between two routers over TCP: it opens, is kept alive, or is found dead."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from desim.middleware.tcp import Connection
from desim.middleware.zenoh.link_queue import LinkQueue, Push
from desim.middleware.zenoh.sizes import (
    INIT_ACK_BYTES,
    INIT_SYN_BYTES,
    KEEP_ALIVE_BYTES,
    OPEN_ACK_BYTES,
    OPEN_SYN_BYTES,
)

if TYPE_CHECKING:
    from desim.middleware.zenoh.router import ZenohRouter
    from desim.middleware.zenoh.topology import LinkState
    from desim.ports.networks import Handle

SERVICE = "zenoh"  # port 7447


class RouterLink:
    """One end of a link. The client sends InitSyn and OpenSyn, the server acknowledges each."""

    def __init__(self, router: ZenohRouter, peer: int) -> None:
        self.router = router
        self.host, self.peer = router.host, peer
        self.life = 0  # that of the peer; 0: not known yet
        self.connection: Connection
        self.far: RouterLink  # the other end
        self.up = False  # the handshake is complete
        self.over = False
        self.expired = False  # it only drains what is written
        # It stands beside an expired link. The own router takes the two for one and does not
        # declare its keys again, so the peer cannot read data from it.
        self.unread = False
        self.named = 0  # routers whose identity has gone over it, as bits
        # By router: its life, and how many of its declarations have gone over the link.
        self.declared: dict[int, tuple[int, int]] = {}
        # Link states that it carried when it was new, and that its router has yet to pass on.
        self.fresh: dict[int, LinkState] = {}
        self.line: LinkQueue
        self.sent_ns = self._opened_ns = 0
        self._timers: dict[str, Handle] = {}
        self._context = router.context

    def dial(self) -> None:
        """Call the peer's router."""
        self._watch_opening()
        self._take(self.router.tcp.connect(
            self.host, self.peer, SERVICE, "link", opened=self._dialled, closed=self.close,
            nodelay=True, keepalive=False))
        self.connection.about = self

    def accept(self, connection: Connection) -> None:
        """The peer has called."""
        self._watch_opening()
        self._take(connection)
        self.far, connection.about.far = connection.about, self
        connection.on_closed(self.host, self.close)

    def send(self, kind: str, size_bytes: int, arrived: Callable[..., object],
             what: object = None, writes: int = 1) -> None:
        """Send a message in ``writes`` writes to the socket; ``arrived(link, what)`` is called at
        the other end."""
        self.sent_ns = self._context.now_ns
        self.connection.send(self.host, size_bytes, self._received, (arrived, what), kind, writes)

    def carried(self, push: Push) -> None:
        """A push has arrived at the other end."""
        if self.unread:
            push.drop("unknown_key")
        elif not push.gone:
            self.far.router.received(push)

    def close(self, *_: object) -> None:
        """End it: all messages on it are lost. Timers and TCP call this, too."""
        if not self.over:
            self.vanish("link_closed")
            self.connection.close(self.host)
            self.router.unlinked(self)

    def vanish(self, reason: str) -> None:
        """End it without a message to the peer."""
        self.over = True
        for timer in self._timers.values():
            timer.cancel()
        self.line.close(reason)

    def _take(self, connection: Connection) -> None:
        self.connection = connection
        self.line = LinkQueue(self)

    def _received(self, token: tuple[Callable[..., object], object]) -> None:
        arrived, what = token
        if not self.far.over:
            arrived(self.far, what)

    # The handshake.

    def _watch_opening(self) -> None:
        self._book("opening", self._context.now_ns + self.router.constants.open_timeout_ns,
                   self.close)

    def _dialled(self, connection: Connection) -> None:
        self.send("link", INIT_SYN_BYTES, RouterLink._init_syn, self.router.life)

    def _init_syn(self, life: int) -> None:
        self.life = life
        if self.router.welcomes(self):
            self.send("link", INIT_ACK_BYTES, RouterLink._init_ack, self.router.life)
        else:
            self.close()

    def _init_ack(self, life: int) -> None:
        self.life = life
        self.send("link", OPEN_SYN_BYTES, RouterLink._open_syn)

    def _open_syn(self, _: object) -> None:
        self.send("link", OPEN_ACK_BYTES, RouterLink._establish)
        self._establish(None)

    def _establish(self, _: object) -> None:
        self.up = True
        self._opened_ns = now_ns = self._context.now_ns
        self._timers.pop("opening").cancel()
        self.router.linked(self)
        if not self.over:
            params = self.router.params
            self._book("beat", now_ns + params.lease_ns // params.keep_alive, self._beat)
            self._book("lease", now_ns + params.lease_ns, self._check_lease)

    # The lease.

    def _beat(self, _: object) -> None:
        """Send a keep-alive when nothing was sent for a while, if the socket takes it."""
        params, now_ns = self.router.params, self._context.now_ns
        pause_ns = params.lease_ns // params.keep_alive
        due_ns = self.sent_ns + pause_ns
        if due_ns <= now_ns:
            due_ns = now_ns + pause_ns
            if self.connection.sender(self.host).writable:
                # Its arrival is all that matters.
                self.send("keepalive", KEEP_ALIVE_BYTES, lambda link, _: None)
        self._book("beat", due_ns, self._beat)

    def _check_lease(self, _: object) -> None:
        """Give up a link over which nothing arrived for a lease. If the socket does not take all
        data, this end lives for another keep-alive (zenoh tx_task: drain)."""
        received_ns = max(self._opened_ns, self.connection.end(self.host).last_data_ns())
        params, now_ns = self.router.params, self._context.now_ns
        due_ns = received_ns + params.lease_ns
        if due_ns > now_ns:
            self._book("lease", due_ns, self._check_lease)
            return
        self.expired = True
        self._book("drain", now_ns + params.lease_ns // params.keep_alive, self.close)
        self.line.flush(self.close)

    def _book(self, name: str, time_ns: int, fn: Callable[..., object]) -> None:
        self._timers[name] = self._context.at(time_ns, self.host, fn)
