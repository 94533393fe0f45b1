"""A link between two routers over TCP, as one of them has it: how it opens, and how it is kept
alive or found dead."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from desim.middleware.tcp import Connection
from desim.middleware.zenoh.line import Line, Parcel
from desim.middleware.zenoh.sizes import (
    INIT_ACK_BYTES,
    INIT_SYN_BYTES,
    KEEP_ALIVE_BYTES,
    OPEN_ACK_BYTES,
    OPEN_SYN_BYTES,
)

if TYPE_CHECKING:
    from desim.middleware.zenoh.router import Router
    from desim.middleware.zenoh.topology import State

SERVICE = "zenoh"  # port 7447


class Link:
    """One end. The client says InitSyn and OpenSyn, the server acknowledges each.

    ``life``: which of the peer's lives it is with (0: not known yet). ``expired``: it is only
    waited for what is written; what comes over a link beside such a one stays ``unread``, for its
    router takes it for the same and does not tell its keys again. What has gone over it:
    ``named``, the routers whose identity has, as bits; ``told``, of each router, its life and how
    many of its declarations have. ``fresh``: link states that it has told when it was new and that
    its router is still to pass on to others.
    """

    __slots__ = ("router", "host", "peer", "life", "connection", "far", "up", "over", "expired",
                 "unread", "named", "told", "fresh", "line", "sent_ns", "_opened_ns", "_timers",
                 "_context")

    def __init__(self, router: Router, peer: int) -> None:
        self.router = router
        self.host, self.peer = router.host, peer
        self.life = 0
        self.connection: Connection
        self.far: Link
        self.up = False
        self.over = False
        self.expired = self.unread = False
        self.named = 0
        self.told: dict[int, tuple[int, int]] = {}
        self.fresh: dict[int, State] = {}
        self.line: Line
        self.sent_ns = self._opened_ns = 0
        self._timers: dict[str, Any] = {}
        self._context = router.context

    def dial(self) -> None:
        """Call the peer's router."""
        self._watch_opening()
        self._take(self.router.tcp.connect(
            self.host, self.peer, SERVICE, "link", opened=self._dialled, closed=self._hung_up,
            nodelay=True, keepalive=False))
        self.connection.about = self

    def accept(self, connection: Connection) -> None:
        """The peer has called."""
        self._watch_opening()
        self._take(connection)
        self.far, connection.about.far = connection.about, self
        connection.on_closed(self.host, self._hung_up)

    def say(self, kind: str, size_bytes: int, hears: Callable[[Link, Any], Any],
            what: Any = None, writes: int = 1) -> None:
        """``hears(link, what)`` at the other end, when it has come. It goes to the socket in so
        many ``writes``."""
        self.sent_ns = self._context.now_ns
        self.connection.send(self.host, size_bytes, self._said, (hears, what), kind, writes)

    def carried(self, parcel: Parcel) -> None:
        """It is at the other end."""
        if self.unread:
            parcel.drop("unknown_key")
        elif not parcel.gone:
            self.far.router.received(parcel)

    def shares(self, other: Link) -> None:
        """What has gone over ``other``, the first with the same peer, need not go over this one."""
        self.named, self.told = other.named, other.told

    def close(self) -> None:
        """Nothing more goes or comes over it: what is on it is lost."""
        if not self.over:
            self.vanish("link_closed")
            self.connection.close(self.host)
            self.router.unlinked(self)

    def vanish(self, reason: str) -> None:
        """It is over, and nobody is told."""
        self.over = True
        for timer in self._timers.values():
            timer.cancel()
        self.line.close(reason)

    def _take(self, connection: Connection) -> None:
        self.connection = connection
        self.line = Line(self)

    def _said(self, token: tuple[Callable[[Link, Any], Any], Any]) -> None:
        hears, what = token
        if not self.far.over:
            hears(self.far, what)

    def _hung_up(self, connection: Connection, reason: str) -> None:
        self.close()

    # How it opens.

    def _watch_opening(self) -> None:
        self._book("opening", self._context.now_ns + self.router.params.open_timeout_ns,
                   self._too_slow)

    def _too_slow(self, _: Any) -> None:
        self.close()

    def _dialled(self, connection: Connection) -> None:
        self.say("link", INIT_SYN_BYTES, Link._init_syn, self.router.life)

    def _init_syn(self, life: int) -> None:
        self.life = life
        if self.router.welcomes(self):
            self.say("link", INIT_ACK_BYTES, Link._init_ack, self.router.life)
        else:
            self.close()

    def _init_ack(self, life: int) -> None:
        self.life = life
        self.say("link", OPEN_SYN_BYTES, Link._open_syn)

    def _open_syn(self, _: Any) -> None:
        self.say("link", OPEN_ACK_BYTES, Link._open_ack)
        self._establish()

    def _open_ack(self, _: Any) -> None:
        self._establish()

    def _establish(self) -> None:
        self.up = True
        self._opened_ns = now_ns = self._context.now_ns
        self._timers.pop("opening").cancel()
        self.router.linked(self)
        if not self.over:
            params = self.router.params
            self._book("beat", now_ns + params.lease_ns // params.keep_alive, self._beat)
            self._book("lease", now_ns + params.lease_ns, self._look)

    # How it is kept, and when it ends.

    def _beat(self, _: Any) -> None:
        """Say something when nothing was said for a while, if the socket takes it."""
        params, now_ns = self.router.params, self._context.now_ns
        pause_ns = params.lease_ns // params.keep_alive
        due_ns = self.sent_ns + pause_ns
        if due_ns <= now_ns:
            due_ns = now_ns + pause_ns
            if self.connection.sender(self.host).room:
                self.say("keepalive", KEEP_ALIVE_BYTES, Link._alive)
        self._book("beat", due_ns, self._beat)

    def _alive(self, _: Any) -> None:
        """To have heard it is all."""

    def _look(self, _: Any) -> None:
        """Give up a link that nothing came over for a lease. Where the socket does not take what
        is written its end lives for another keep-alive (zenoh tx_task: drain)."""
        heard_ns = max(self._opened_ns, self.connection.end(self.host).data_heard_ns())
        params, now_ns = self.router.params, self._context.now_ns
        due_ns = heard_ns + params.lease_ns
        if due_ns > now_ns:
            self._book("lease", due_ns, self._look)
            return
        self.expired = True
        self._book("drain", now_ns + params.lease_ns // params.keep_alive, self._too_slow)
        self.line.flush(self.close)

    def _book(self, name: str, time_ns: int, fn: Callable[[Any], Any]) -> None:
        self._timers[name] = self._context.at(time_ns, self.host, fn)
