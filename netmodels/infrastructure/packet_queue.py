"""The contract of queues in front of radios, and the plain one."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from netmodels.infrastructure.outlets import AirHop


Receivers = tuple[int, ...]


class Waiting(NamedTuple):
    """A packet that waits: its hop, its number there, its size, and since when."""

    hop: AirHop
    number: int
    size_bytes: int
    since_ns: int

    def only_for(self, dest: int | None) -> bool:
        """Whether it is for this station alone (None: any)."""
        return dest is None or not self.hop.broadcast and self.hop.receivers[0] == dest


Dropped = tuple[Waiting, str]  # and the reason


class PacketQueue(Protocol):
    """The packets that wait for a radio."""

    def push(self, now_ns: int, packets: Sequence[Waiting], inside: int) -> list[Dropped]:
        """Let packets of one hop wait, while others are ``inside`` the radio. Returns those that
        are dropped for it, of any hop."""

    def pop(self, now_ns: int, dropped: list[Dropped], takes: Callable[[Receivers], bool]
            ) -> Waiting | None:
        """The packet that is sent next, which leaves; None: nobody waits for whom the radio
        ``takes`` in more. Those that are dropped on that occasion are added to ``dropped``."""

    def take_out(self, dest: int | None) -> list[Waiting]:
        """All packets for this station alone (None: all), which leave."""


class PlainQueue:
    """The first to come is the first to go, as soon as the radio has room; what comes while
    ``limit`` packets wait, there or here, is dropped."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._waiting: deque[Waiting] = deque()

    def push(self, now_ns: int, packets: Sequence[Waiting], inside: int) -> list[Dropped]:
        free = max(self._limit - inside - len(self._waiting), 0)
        self._waiting.extend(packets[:free])
        return [(packet, "queue_full") for packet in packets[free:]]

    def pop(self, now_ns: int, dropped: list[Dropped], takes: Callable[[Receivers], bool]
            ) -> Waiting | None:
        return self._waiting.popleft() if self._waiting else None

    def take_out(self, dest: int | None) -> list[Waiting]:
        gone = [packet for packet in self._waiting if packet.only_for(dest)]
        self._waiting = deque(packet for packet in self._waiting if not packet.only_for(dest))
        return gone
