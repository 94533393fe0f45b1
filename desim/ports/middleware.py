"""The contract of a middleware: who may talk to whom, as its registries have it.

A registry that knows everything at once is thirty lines (``desim.middleware.direct``). One that has
to find out over the network sends frames of its own, keeps what each host believes, and may carry
the messages by transports of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar, Literal, NamedTuple, Protocol, TypeVar, runtime_checkable

import numpy as np

from desim.ports.networks import Handle
from desim.ports.parameters import Params

T = TypeVar("T")


class Endpoint(NamedTuple):
    """A subscription or an advertisement of ``topic`` by ``node`` on host index ``host``."""

    host: int
    node: str
    topic: str


class Offer(NamedTuple):
    """The wishes of a publisher for its messages: ``transport`` stream or datagram, ``via`` unicast
    or broadcast; ``queue`` of them may wait for each receiver (0: any number); ``latch``: a new
    receiver gets the last one."""

    publisher: Endpoint
    transport: str
    via: str
    queue: int
    latch: bool


class MiddlewareContext(Protocol):
    """All that a middleware may know and do. Hosts are indices, in the order of ``hosts``."""

    @property
    def now_ns(self) -> int:
        """The time."""

    @property
    def hosts(self) -> tuple[str, ...]:
        """Their names, in index order."""

    def at(self, time_ns: int, host: int, fn: Callable[[T], object], arg: T | None = None
           ) -> Handle:
        """Call ``fn(arg)`` at ``time_ns`` in phase NETWORK, in the turn of ``host``. The call does
        not die with its host: cancel it when that is ``switched``."""

    def up(self, host: int) -> bool:
        """Whether ``host`` runs."""

    def stream(self, *name: str | int) -> np.random.Generator:
        """Random numbers by name, the middleware's own."""

    def changed(self, topic: str) -> None:
        """``subscribers`` gives other answers now for publishers of ``topic``."""

    def send(self, kind: str, source: int, receivers: Sequence[int], size_bytes: int,
             heard: Callable[[T, int], object], token: T | None = None, *, segments: int = 1,
             multicast: bool = False,
             in_part: Callable[[T, int, dict[int, str]], object] | None = None) -> None:
        """Send a frame of the middleware's own, of ``size_bytes`` with all headers, to each of
        ``receivers``; with ``multicast``, one on each medium for all of them. Where one arrives,
        ``heard(token, receiver)`` is called; where one is lost, nothing is. Its bytes are counted
        under ``kind``, as bytes of discovery. Hosts without a medium in common hear nothing.

        A frame of several packets is one datagram, which is lost with any of them; with
        ``in_part``, it is a train of several: ``in_part(token, receiver, lost)`` is called where
        some of its packets arrive, with the numbers of the others and why they were lost."""

    def knows(self, believer: int, other: int, topic: str, holds: bool) -> None:
        """``believer`` believes from now on (or no longer) that ``other`` is at the other end of
        ``topic``. The account of beliefs is for a middleware that ``Informs``."""

    def sees(self, believer: int, other: int, state: str) -> None:
        """``believer`` takes ``other`` for ``online``, ``offline`` or ``removed`` from now on."""


class Transport(Protocol):
    """Takes the messages of one publisher to the hosts that listen. Each message has one fate at
    each of these: delivered once, or dropped once for a reason."""

    def connect(self, receivers: list[int]) -> list[int]:
        """Lead to ``receivers`` from now on, and to nobody else. Returns the new ones of those that
        can be reached."""

    def send(self, message: Any, only: list[int] | None = None) -> None:
        """Take a ``desim.middleware.topics.Message`` to all receivers, or to ``only`` these."""

    def close(self, reason: str) -> None:
        """The publisher is gone: drop what waits for ``reason``."""

    def waiting(self) -> int:
        """Receptions under way: messages times receivers."""


class Middleware(Protocol):
    """The registries: who may talk to whom, what is known of it now, and what it costs to know.

    Built as ``Middleware(params)``. It may also have the capabilities ``CarriesMessages`` and
    ``Informs``.
    """

    Params: ClassVar[type[Params]]

    def start(self, context: MiddlewareContext) -> None:
        """Called once, before any host starts. Raises ``InputError`` for parameters that do not fit
        the hosts; a line that begins with a dot and a path points at that parameter."""

    def switched(self, host: int, up: bool) -> None:
        """The host starts, with nothing remembered, or has stopped: what it advertised and
        subscribed to is gone with it. Whether a registry notices that is the model's matter."""

    def advertise(self, offer: Offer) -> None:
        """A node of a host that runs begins to publish."""

    def subscribe(self, subscriber: Endpoint) -> None:
        """A node of a host that runs begins to listen."""

    def subscribers(self, publisher: Endpoint) -> tuple[Endpoint, ...]:
        """The receivers of this publisher's messages now, in a fixed order."""


@runtime_checkable
class CarriesMessages(Protocol):
    """A middleware with transports of its own. The messages of others travel by desim's streams and
    datagrams, which know nothing of registries."""

    def transport(self, offer: Offer) -> Transport:
        """A transport for a publisher's messages. Raises ``InputError``, ``.via: ...``, for an
        offer that it cannot meet."""


@runtime_checkable
class Informs(Protocol):
    """A middleware whose hosts have to learn of each other before messages flow. desim holds their
    beliefs against the truth; the middleware reports them by ``MiddlewareContext.knows`` and
    ``sees``."""

    @property
    def informed(self) -> Literal["subscriber", "publisher"]:
        """The end that has to learn of the other one."""
