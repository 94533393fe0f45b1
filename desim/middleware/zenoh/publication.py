"""The transport of one publisher's messages: into the links of its host's router."""

from __future__ import annotations

from collections.abc import Callable

from desim.middleware.message import Message
from desim.middleware.zenoh.link_queue import Push
from desim.middleware.zenoh.router import ZenohRouter
from desim.ports.middleware import Advertisement, MiddlewareContext, TransportKind


class ZenohPublication:
    """A ``Transport``. ``blocks``: where a link has no room a message waits until there is some
    (congestion control "block"), else it is soon dropped ("drop"); ``node`` waits with it.
    rmw_zenoh blocks for what is reliable and keeps all: a stream without a limit (queue 0)."""

    def __init__(self, advertised: Advertisement, context: MiddlewareContext,
                 router: Callable[[int], ZenohRouter]) -> None:
        self.source, self.node = advertised.publisher.host, advertised.publisher.node
        self.blocks = advertised.transport == TransportKind.STREAM and advertised.queue == 0
        self._context = context
        self._router = router
        self._receivers: list[int] = []
        self._pending = 0

    def connect(self, receivers: list[int]) -> list[int]:
        old = self._receivers
        self._receivers = receivers
        return [receiver for receiver in receivers if receiver not in old]

    def send(self, message: Message, only: list[int] | None = None) -> None:
        to = self._receivers if only is None else only
        self._pending += len(to)
        self._router(self.source).forward(message, self, to, -1, -1, 0)

    def close(self, reason: str) -> None:
        self._receivers = []
        self._router(self.source).discard(self, reason)

    def waiting(self) -> int:
        return self._pending

    # Fates, from routers.

    def arrived(self, push: Push, receiver: int) -> None:
        self._pending -= 1
        self._context.deliver(push.message, receiver, push.first_ns, push.last_ns)

    def dropped(self, push: Push, reason: str) -> None:
        for receiver in push.to:
            self.lost(push.message, receiver, reason, push.first_ns, push.last_ns)

    def lost(self, message: Message, receiver: int, reason: str, first_ns: int,
             last_ns: int) -> None:
        self._pending -= 1
        self._context.drop(message, receiver, reason, first_ns, last_ns)
