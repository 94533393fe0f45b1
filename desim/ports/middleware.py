"""The contract of a middleware: who may talk to whom, as somebody's registries have it.

A registry that knows everything at once is thirty lines (``desim.middleware.direct``). One that has
to find out over the network sends frames of its own, keeps what each host believes, and may carry
the messages by transports of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np

from desim.ports import Params


class Endpoint(NamedTuple):
    """A subscription or an advertisement of ``topic`` by ``node`` on host index ``host``."""

    host: int
    node: str
    topic: str


class Offer(NamedTuple):
    """What a publisher wants for its messages: ``transport`` stream or datagram, ``via`` unicast or
    broadcast; ``queue`` of them may wait for each receiver (0: any number); ``latch``: the last one
    goes to whoever is new."""

    publisher: Endpoint
    transport: str
    via: str
    queue: int
    latch: bool


class MiddlewareContext(Protocol):
    """All that a middleware may know and do. Hosts are indices, in the order of ``hosts``."""

    now_ns: int
    hosts: tuple[str, ...]

    def at(self, time_ns: int, host: int, fn: Callable[[Any], Any], arg: Any = None) -> Any:
        """Call ``fn(arg)`` at ``time_ns`` in phase NETWORK, in the turn of ``host``; the handle has
        ``cancel()``. Who wants it to die with its host cancels it when that is ``switched``."""

    def up(self, host: int) -> bool:
        """Whether ``host`` runs."""

    def stream(self, *name: str | int) -> np.random.Generator:
        """Random numbers by name, the middleware's own."""

    def changed(self, topic: str) -> None:
        """``subscribers`` answers differently now for publishers of ``topic``."""

    def tell(self, kind: str, source: int, receivers: Sequence[int], size_bytes: int,
             heard: Callable[[Any, int], Any], token: Any = None, *, segments: int = 1,
             multicast: bool = False,
             in_part: Callable[[Any, int, dict[int, str]], Any] | None = None) -> None:
        """Send the same frames of the middleware's own, of ``size_bytes`` with all headers, to each
        of ``receivers``, or with ``multicast`` one on each medium for all of them. Where one
        arrives, ``heard(token, receiver)`` is called; what gets lost is lost. ``kind`` is what they
        are counted under, as bytes of discovery. Hosts without a medium in common hear nothing.

        A frame of several packets is one datagram, which is lost with any of them; or with
        ``in_part`` a train of several: ``in_part(token, receiver, lost)`` is called where some of
        its packets arrive, with the numbers of the others."""

    def knows(self, believer: int, other: int, topic: str, holds: bool) -> None:
        """``believer`` believes from now on (or no longer) that ``other`` is at the other end of
        ``topic``: for the account of who believes what, see ``Middleware.informed``."""

    def sees(self, believer: int, other: int, state: str) -> None:
        """``believer`` takes ``other`` for ``online``, ``offline`` or ``removed`` from now on."""


class Transport(Protocol):
    """Takes the messages of one publisher to the hosts that listen. It accounts for each message at
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
    """Who may talk to whom: the registries, what they know now, and what it costs to know.

    Two things that a middleware may have beside: ``transport(offer) -> Transport``, by which a
    publisher's messages travel (without it: by desim's own streams and datagrams, which know
    nothing of registries; it raises ``InputError``, ``.via: ...``, for an offer that it cannot
    meet); ``informed``, ``"subscriber"`` or ``"publisher"``: which end has to learn of the other
    one before messages flow. With it, what hosts believe is held against the truth, and its
    ``context.knows`` and ``context.sees`` are to say what they believe.
    """

    Params: ClassVar[type[Params]]

    def start(self, context: MiddlewareContext) -> None:
        """Called once, before any host starts. Raises ``InputError`` for parameters that do not fit
        the hosts; a line that begins with a dot and a path points at that parameter."""

    def switched(self, host: int, up: bool) -> None:
        """The host starts, with nothing remembered, or has stopped: what it advertised and
        subscribed to is gone with it. Whether a registry notices that is the model's matter."""

    def advertise(self, offer: Offer) -> None: ...

    def subscribe(self, subscriber: Endpoint) -> None: ...

    def subscribers(self, publisher: Endpoint) -> tuple[Endpoint, ...]:
        """Whom this publisher's messages go to now, in a fixed order."""
