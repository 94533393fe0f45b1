"""Media inside a host: buses between its sensors, its motors and its processor.

Messages between nodes of one host take no medium, unless their topic has one inside the host. Then
they have frames, a fate and a latency, like messages between hosts.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from desim.middleware.message import Message
    from desim.ports.middleware import Transport


class WithInside:
    """The transport of a publisher whose topic has a medium ``inside`` its host, index ``own``, and
    goes ``outside`` to other hosts as any other does."""

    def __init__(self, own: int, inside: Transport, outside: Transport) -> None:
        self._own, self._inside, self._outside = own, inside, outside

    def connect(self, receivers: list[int]) -> list[int]:
        own = [receiver for receiver in receivers if receiver == self._own]
        others = [receiver for receiver in receivers if receiver != self._own]
        return [*self._inside.connect(own), *self._outside.connect(others)]

    def send(self, message: Message, only: list[int] | None = None) -> None:
        if only is None:
            self._inside.send(message)
            self._outside.send(message)
            return
        for transport, to in ((self._inside, [host for host in only if host == self._own]),
                              (self._outside, [host for host in only if host != self._own])):
            if to:
                transport.send(message, to)

    def close(self, reason: str) -> None:
        self._inside.close(reason)
        self._outside.close(reason)

    def waiting(self) -> int:
        return self._inside.waiting() + self._outside.waiting()
