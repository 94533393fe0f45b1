"""The messages of discovery that a participant sends in one instant.

Those to one host leave as trains: computed one by one, those for 25 participants would cost 25
times as much.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import TYPE_CHECKING, NamedTuple

from desim.middleware.dds.wire import WireSize, together

if TYPE_CHECKING:
    from desim.ports.middleware import DatagramSocket, MiddlewareContext

MOST_PACKETS = 64  # of a train (ours)
LOOPBACK_NS = 10_000  # from a participant to another one of its host (ours)


class OutgoingMessage(NamedTuple):
    """A message, or several that stand for each other, and who takes it at the other end:
    ``arrived(what, receiver, lost)``, with the numbers of its packets that are lost."""

    size: WireSize
    arrived: Callable[..., object]
    what: object


class Outbox:
    """The outbox of a participant on ``host``, which sends all by ``socket``."""

    def __init__(self, context: MiddlewareContext, host: int, socket: DatagramSocket) -> None:
        self._context, self._host, self._socket = context, host, socket
        # By kind and receiving host.
        self._posted: dict[tuple[str, int], list[OutgoingMessage]] = {}

    def post(self, kind: str, to: int, posted: OutgoingMessage) -> None:
        """Send a message at the end of this instant."""
        if not self._posted:
            self._context.at(self._context.now_ns, self._host, self.flush)
        self._posted.setdefault((kind, to), []).append(posted)

    def flush(self, _: object = None) -> None:
        """Send what was posted."""
        posted, self._posted = self._posted, {}
        for (kind, to), messages in posted.items():
            if to == self._host:
                self._context.at(self._context.now_ns + LOOPBACK_NS, to, self._loop_back, messages)
                continue
            train: list[OutgoingMessage] = []
            packets = 0
            for message in messages:
                if train and packets + message.size.packets > MOST_PACKETS:
                    self._send(kind, to, train)
                    train, packets = [], 0
                train.append(message)
                packets += message.size.packets
            self._send(kind, to, train)

    def _loop_back(self, messages: list[OutgoingMessage]) -> None:
        _arrived(messages, self._host)

    def _send(self, kind: str, to: int, train: list[OutgoingMessage]) -> None:
        size_bytes, packets = together([message.size for message in train])
        self._context.send(kind, self._host, [to], size_bytes, _arrived, train, segments=packets,
                           in_part=_arrived, socket=self._socket)


def _arrived(train: list[OutgoingMessage], receiver: int, lost: Collection[int] = ()) -> None:
    first = 0
    for (_, packets), arrived, what in train:
        own = [number - first for number in lost if first <= number < first + packets] \
            if lost else ()
        if len(own) < packets:
            arrived(what, receiver, own)
        first += packets
