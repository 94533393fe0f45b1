"""The contract of a middleware: who may talk to whom, as its registries have it.

A registry that knows everything at once is thirty lines (``desim.middleware.direct``). One that has
to find out over the network sends frames of its own, keeps what each host believes, and may carry
the messages by transports of its own. desim's own middlewares reach the graph only through these
ports. They also use the kernel's phases, and the helpers in ``desim.middleware`` (timers, TCP).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from enum import StrEnum
from typing import Any, Literal, NamedTuple, Protocol, TypeAlias, TypeVar, runtime_checkable

import numpy as np

from desim.ports.networks import Handle
from desim.ports.parameters import Params as ParamsBase

T = TypeVar("T")

# A ``desim.middleware.message.Message``, which this package cannot name. Transports read its
# ``seq``, ``size_bytes`` and ``born_ns``.
Published: TypeAlias = Any

# Takes an arrival whose time is known in advance, so that no event is needed: called at once as
# ``fn(time_ns, arrived, token)``. The event would have called ``arrived(token, receiver)``.
InAdvance = Callable[[int, Callable[..., object], object], object]


class Endpoint(NamedTuple):
    """A subscription or an advertisement of ``topic`` by ``node`` on host index ``host``."""

    host: int
    node: str
    topic: str


class TransportKind(StrEnum):
    """The two ways to make frames of messages: in order and repaired, or one by one."""

    STREAM = "stream"
    DATAGRAM = "datagram"


class Addressing(StrEnum):
    """The addressees of a datagram: each receiver by itself, or all at once."""

    UNICAST = "unicast"
    BROADCAST = "broadcast"


class HostState(StrEnum):
    """The state that one host assumes of another."""

    ONLINE = "online"
    OFFLINE = "offline"
    REMOVED = "removed"


class Advertisement(NamedTuple):
    """A publisher, and the way in which it wants its messages carried. ``queue``: messages that may
    wait per receiver (0: no limit). ``latch``: a new receiver gets the last message."""

    publisher: Endpoint
    transport: TransportKind
    via: Addressing
    queue: int
    latch: bool


class Clock(Protocol):
    """The kernel (``desim.engine.kernel.Kernel``), for events in another phase than NETWORK or in
    the turn of a pair of hosts."""

    @property
    def now_ns(self) -> int:
        """The time."""

    @property
    def at(self) -> Callable[..., Handle]:
        """``at(time_ns, phase, entity, fn, arg=None)`` calls ``fn(arg)`` then."""

    @property
    def after(self) -> Callable[..., Handle]:
        """``after(delay_ns, phase, entity, fn, arg=None)`` calls ``fn(arg)`` then."""


class Sends(Protocol):
    """Takes frames to other hosts: a medium, or an entry of an address table."""

    @property
    def transmit(self) -> Callable[..., int | None]:
        """``transmit(source, receivers, size_bytes, segments, broadcast, carrier, token)`` sends a
        frame to ``receivers`` (ascending). ``carrier`` (``desim.network.carrier``) hears of its
        fate at each of them, with ``token``. Returns when (ns) it arrives, if it has one receiver,
        no rule has touched it and the model knows at once; else None."""


class Route(Sends, Protocol):
    """A medium: ``id`` stands for it in trace rows."""

    @property
    def id(self) -> int: ...

    @property
    def post(self) -> Callable[..., int | None]:
        """``post(source, receivers, size_bytes, carrier, token)`` sends one packet to one host.
        Where ``transmit`` returns a time, so does this, and the carrier hears nothing: it costs no
        event."""


class DatagramSocket(Protocol):
    """A host's UDP socket."""

    @property
    def send(self) -> Callable[..., int | None]:
        """``send(route, receivers, size_bytes, packets, broadcast, carrier, token, each=1,
        node=None)`` sends a train of datagrams of ``each`` packets, as ``Sends.transmit`` does.
        While the send buffer is full it waits, and ``node``, which publishes it, with it."""

    @property
    def waits(self) -> bool:
        """Whether something waits for room."""

    def when_free(self, fn: Callable[[], object]) -> None:
        """Call ``fn`` once, when nothing waits any more."""


class AddressEntry(Sends, Protocol):
    """A host's entry for the address of another one. ``confirmed_ns``: when its sender knew last
    that the address is right."""

    confirmed_ns: int


class AddressTables(Protocol):
    """The tables of all hosts that map hosts to addresses (ARP)."""

    def of(self, medium: Route, host: int, peer: int) -> AddressEntry:
        """The entry of ``peer`` at ``host``, made on first use."""

    def forget(self, host: int) -> None:
        """Empty the table of ``host``, which has stopped."""


class MiddlewareContext(Protocol):
    """All that a middleware may know and do. Hosts are indices, in the order of ``hosts``.

    ``discovery_bytes`` and ``discovery_frames`` count the middleware's own frames by kind.
    """

    discovery_bytes: dict[str, int]
    discovery_frames: dict[str, int]

    @property
    def hosts(self) -> tuple[str, ...]:
        """Their names, in index order."""

    @property
    def host_ids(self) -> tuple[int, ...]:
        """Their trace ids, in index order."""

    # Time and randomness.

    @property
    def now_ns(self) -> int:
        """The time."""

    @property
    def kernel(self) -> Clock:
        """The clock, for what ``at`` cannot do."""

    def at(self, time_ns: int, host: int, fn: Callable[[T], object], arg: T | None = None
           ) -> Handle:
        """Call ``fn(arg)`` at ``time_ns`` in phase NETWORK, in the turn of ``host``. The call does
        not die with its host: cancel it when that is ``switched``."""

    def stream(self, *name: str | int) -> np.random.Generator:
        """Random numbers by name, the middleware's own."""

    # Hosts and registries.

    def up(self, host: int) -> bool:
        """Whether ``host`` runs."""

    def life(self, host: int) -> int:
        """The number of starts of ``host`` so far: which of its lives it is in."""

    def changed(self, topic: str) -> None:
        """Report that ``subscribers`` may now return something else for publishers of ``topic``."""

    def send(self, kind: str, source: int, receivers: Sequence[int], size_bytes: int,
             arrived: Callable[[T, int], object], token: T | None = None, *, segments: int = 1,
             multicast: bool = False,
             in_part: Callable[[T, int, dict[int, str]], object] | None = None,
             in_advance: Callable[[int], InAdvance | None] | None = None,
             socket: DatagramSocket | None = None) -> None:
        """Send a frame of the middleware's own, of ``size_bytes`` with all headers, to each of
        ``receivers``; with ``multicast``, one on each medium for all of them. Where one arrives,
        ``arrived(token, receiver)`` is called; where one is lost, nothing is. Its bytes are counted
        under ``kind``, as bytes of discovery. Hosts without a medium in common hear nothing. It
        waits for room in its ``socket``; without one in none.

        A frame of several packets is one datagram, which is lost with any of them; with
        ``in_part``, it is a train of several: ``in_part(token, receiver, lost)`` is called where
        some of its packets arrive, with the numbers of the others and why they were lost.

        ``in_advance(receiver)`` is a shortcut for messages that only show that their sender lives,
        or nothing at all. It may return a function that notes the arrival at ``receiver`` at once,
        without an event; that is called if the medium knows when a single packet will arrive."""

    def record_control(self, kind: str, source: int, to: int, size_bytes: int) -> None:
        """Count a frame of the middleware's own that ``source`` sends by a ``Route``, and write its
        trace row; ``to`` is the trace id of a host or medium."""

    def record(self, kind: str, host: int, a: int = 0, b: int = 0, c: int = 0) -> None:
        """Write a trace row of ``host``."""

    # Beliefs.

    def knows(self, believer: int, other: int, topic: str, holds: bool) -> None:
        """Report that ``believer`` has learnt of (``holds``) or forgotten its match with ``other``
        on ``topic``. The account of beliefs is for a middleware that ``Informs``."""

    def sees(self, believer: int, other: int, state: HostState) -> None:
        """Report that ``believer`` sees ``other`` in this state from now on."""

    # Messages, for transports of the middleware's own.

    def default_transport(self, advertised: Advertisement) -> Transport:
        """The transport that desim takes where the middleware has none of its own."""

    def route(self, source: int, receiver: int, topic: str = "") -> Route | None:
        """The way for frames from ``source`` to ``receiver``, with messages of ``topic`` (absolute)
        if they carry some; None: there is none. It may lead over another medium later, or through
        hosts that forward."""

    def frames(self, source: int, receivers: Iterable[int], topic: str, multicast: bool
               ) -> tuple[Sequence[tuple[Route, tuple[int, ...]]], list[int]]:
        """The frames that bring a datagram to ``receivers``: the way of each and those whom it is
        for, one receiver, or with ``multicast`` all on the medium that their ways take now. And the
        receivers to whom no way leads. ``topic``: of the message, "" without one."""

    def resolve_addresses(self, tick_ns: int) -> AddressTables:
        """Switch on ARP: hosts resolve each other's addresses. ``tick_ns`` is the granularity of
        Linux's timers."""

    def socket(self, host: int, name: str) -> DatagramSocket:
        """The socket of ``host`` that all who know this ``name`` share, opened when it is first
        asked for and closed when the host stops."""

    def block(self, host: int, node: str) -> None:
        """A call of ``node`` waits: the node runs no callback until ``unblock`` has been called as
        often. The time of a busy computer's callback goes on."""

    def unblock(self, host: int, node: str) -> None:
        """A call of ``node`` waits no more."""

    def waited(self, since_ns: int) -> None:
        """Note for the ledger that the frame that is sent next has waited at its sender."""

    @property
    def deliver(self) -> Callable[[Published, int, int, int], object]:
        """``deliver(message, receiver, first_ns, last_ns)``: it has arrived; its first and last
        frame were sent at these instants (-1: none was)."""

    @property
    def drop(self) -> Callable[..., object]:
        """``drop(message, receiver, reason, first_ns=-1, last_ns=-1)``: it never will."""

    @property
    def repeat(self) -> Callable[[Published, int], object]:
        """``repeat(message, receiver)``: a copy of a message that was delivered has arrived."""

    @property
    def record_frame(self) -> Callable[[int, int, int, int], object]:
        """``record_frame(source, to, seq, size_bytes)`` writes the trace row of a frame of message
        ``seq``; ``source`` and ``to`` are trace ids of hosts, or of a medium for a multicast."""

    def relay(self, message: Published, host: int) -> None:
        """Note for the ledger that ``host`` will pass on a message that arrives there now."""

    def record_loss(self, source: int, receiver: int, seq: int, reason: str) -> None:
        """Write the trace row of a frame of message ``seq`` that will be sent again."""


class Transport(Protocol):
    """Carries the messages of one publisher to its receivers. Each message has one fate at each
    receiver: delivered once, or dropped once for a reason."""

    def connect(self, receivers: list[int]) -> list[int]:
        """Connect to exactly these receivers from now on. Returns those newly connected; a receiver
        that cannot be reached is not among them."""

    def send(self, message: Published, only: list[int] | None = None) -> None:
        """Carry a ``desim.middleware.message.Message`` to all receivers, or to ``only`` these."""

    def close(self, reason: str) -> None:
        """The publisher is gone: drop what waits for ``reason``."""

    def waiting(self) -> int:
        """Receptions under way: messages times receivers."""


class Middleware(Protocol):
    """The registries: who may talk to whom, what is known of it now, and what it costs to know.

    Built as ``Middleware(params)``. It may also have the capabilities ``CarriesMessages`` and
    ``Informs``.
    """

    @property
    def Params(self) -> type[ParamsBase]:  # noqa: N802 - plug-ins have a class of this name
        """The class of its parameters."""

    def start(self, context: MiddlewareContext) -> None:
        """Called once, before any host starts. Raises ``InputError`` for parameters that do not fit
        the hosts; a line that begins with a dot and a path points at that parameter."""

    def switched(self, host: int, up: bool) -> None:
        """The host starts, with nothing remembered, or has stopped: what it advertised and
        subscribed to is gone with it. Whether a registry notices that is the model's matter."""

    def advertise(self, advertised: Advertisement) -> None:
        """A node of a host that runs begins to publish."""

    def subscribe(self, subscriber: Endpoint) -> None:
        """A node of a host that runs begins to listen."""

    def subscribers(self, publisher: Endpoint) -> tuple[Endpoint, ...]:
        """The receivers of this publisher's messages now, in a fixed order."""


@runtime_checkable
class CarriesMessages(Protocol):
    """A middleware with transports of its own. The messages of others travel by desim's streams and
    datagrams, which know nothing of registries."""

    def transport(self, advertised: Advertisement) -> Transport:
        """A transport for a publisher's messages. Raises ``InputError``, ``.via: ...``, for an
        advertisement that it cannot meet."""


@runtime_checkable
class SharesLinks(Protocol):
    """A middleware that carries all topics between two hosts over one link, if ``shares_links`` is
    True. Under it no topic can choose its medium (``topics`` of a scenario)."""

    @property
    def shares_links(self) -> bool:
        """Whether it does, known as soon as the middleware is made."""


@runtime_checkable
class HasDomains(Protocol):
    """A middleware under which hosts of different domains never hear of each other, however near
    they are. They are no readers of each other's messages."""

    def domains(self, hosts: Sequence[str]) -> Sequence[int]:
        """The domain of each of ``hosts``, known as soon as the middleware is made. Raises
        ``InputError``, ``.domain: ...``, where there are no such hosts."""


@runtime_checkable
class CountsPairs(Protocol):
    """A middleware whose processes have to find each other, one by one."""

    def pairs(self) -> tuple[int, int]:
        """The ordered pairs of processes that run and of which the first knows all that the second
        announces, and the number of all; with a server, those of it and a client."""


@runtime_checkable
class Informs(Protocol):
    """A middleware whose hosts have to learn of each other before messages flow. desim holds their
    beliefs against the truth; the middleware reports them by ``MiddlewareContext.knows`` and
    ``sees``."""

    @property
    def informed(self) -> Literal["subscriber", "publisher"]:
        """The end that has to learn of the other one."""
