"""All TCP connections of a run: its listeners, and the ends that stop with their host."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from desim.middleware.context import ACKS
from desim.middleware.tcp.connection import Closed, Connection
from desim.middleware.tcp.end import End
from desim.middleware.tcp.parameters import TcpParams
from desim.middleware.timers import Timers

if TYPE_CHECKING:
    from desim.ports.middleware import AddressEntry, AddressTables, MiddlewareContext, Route


class Known:
    """The entry of a peer whose address is configured (``arp: static``)."""

    def __init__(self, transmit: Callable[..., int | None]) -> None:
        self.transmit = transmit
        self.confirmed_ns = 0  # of no use: it does not expire


class Tcp:
    """All connections between the hosts of ``context``. Within a host there is none: ``client`` and
    ``server`` are different hosts."""

    def __init__(self, context: MiddlewareContext, params: TcpParams) -> None:
        self.context = context
        self.constants = params.constants
        self.timers = Timers(context.kernel, self.constants.rto_min_ns // 4)
        self.keepers = Timers(context.kernel, self.constants.keepalive_interval_ns)
        context.discovery_bytes.setdefault(ACKS, 0)
        context.discovery_frames.setdefault(ACKS, 0)
        self._calls = 0
        self._tables: AddressTables | None = None  # None: addresses are configured
        if params.arp == "natural":
            self._tables = context.resolve_addresses(self.constants.tick_ns)
        self._listeners: dict[tuple[int, str], Callable[[Connection], object]] = {}
        self._opened: dict[Connection, Callable[[Connection], object]] = {}
        self._ends: dict[int, dict[End, None]] = {}

    def listen(self, host: int, service: str, accepted: Callable[[Connection], object]) -> None:
        """Call ``accepted(connection)`` for each connection to ``service`` that ``host`` takes,
        until it stops."""
        self._listeners[host, service] = accepted

    def connect(self, client: int, server: int, service: str, kind: str, *,
                opened: Callable[[Connection], object], closed: Closed, nodelay: bool = False,
                keepalive: bool = True, topic: str = "") -> Connection:
        """Connect to ``service`` on ``server``. ``opened(connection)`` is called when it has
        answered, ``closed(connection, reason)`` when it has not, or later: see
        ``Connection.on_closed``.

        The bytes of control segments are counted under ``kind``. ``nodelay``: both ends
        do without Nagle's algorithm. ``keepalive``: both ends probe a silent peer. ``topic``: the
        one whose messages it carries, if it carries those of one.
        """
        medium = self.context.route(client, server, topic)
        self._calls += 1
        connection = Connection(self, self._calls, client, server, service, kind,
                                medium, nodelay, keepalive)
        end = connection.ends[0]
        end.closed = closed
        self._opened[connection] = opened
        self.hold(end)
        if medium is None:
            end.give_up("unreachable")
        else:
            end.call()
        return connection

    def switched(self, host: int, up: bool) -> None:
        """A stopped host forgets its connections and listeners; nobody learns of it."""
        if not up:
            for end in list(self._ends.get(host, ())):
                end.vanish()
            if self._tables is not None:
                self._tables.forget(host)
            for listener in [key for key in self._listeners if key[0] == host]:
                del self._listeners[listener]

    # For ends.

    def way(self, medium: Route | None, host: int, peer: int) -> AddressEntry:
        """The address entry that takes frames from ``host`` to ``peer``."""
        if medium is None:
            return Known(_nowhere)
        return Known(medium.transmit) if self._tables is None else self._tables.of(
            medium, host, peer)

    def listening(self, host: int, service: str) -> bool:
        return (host, service) in self._listeners

    def opened(self, connection: Connection) -> None:
        self._opened.pop(connection)(connection)

    def accepted(self, connection: Connection) -> None:
        self._listeners[connection.server, connection.service](connection)

    def hold(self, end: End) -> None:
        """``end`` exists from now on."""
        self._ends.setdefault(end.host, {})[end] = None

    def release(self, end: End) -> None:
        """``end`` is over: forget it."""
        self._ends.get(end.host, {}).pop(end, None)
        if end is end.connection.ends[0]:
            self._opened.pop(end.connection, None)


def _nowhere(*_: object) -> None:
    """Between hosts without a medium in common every frame is lost."""
