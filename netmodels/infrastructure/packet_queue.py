"""The contract of queues in front of radios, and the plain one."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from netmodels.infrastructure.outlets import AirHop


Receivers = tuple[int, ...]


class Waiting(NamedTuple):
    """A packet that waits: its hop, its number there, its size, and since when; or so many
    ``packets`` of one hop, from that number on, of ``size_bytes`` in all."""

    hop: AirHop
    number: int
    size_bytes: int
    since_ns: int
    packets: int = 1

    def part(self, first: int, count: int) -> Waiting:
        """``count`` of its packets, from the ``first`` one on, counted from 0."""
        if count == self.packets:
            return self
        number = self.number + first
        return Waiting(self.hop, number, sum(self.hop.sizes[number:number + count]), self.since_ns,
                       count)

    @property
    def longest_bytes(self) -> int:
        """The size of its first packet; none is longer."""
        return self.size_bytes if self.packets == 1 else self.hop.sizes[self.number]

    def singly(self) -> list[Waiting]:
        """Its packets, each for itself."""
        return [self.part(number, 1) for number in range(self.packets)]

    def only_for(self, dest: int | None) -> bool:
        """Whether it is for this station alone (None: any)."""
        return dest is None or not self.hop.broadcast and self.hop.receivers[0] == dest


Dropped = tuple[Waiting, str]  # and the reason

# How many packets of so many bytes a radio takes in for a station (None: for whomever); of 0 B: how
# many it has places for.
Takes = Callable[[Receivers | None, int], int]


def take_first(waiting: deque[Waiting], most: int) -> Waiting:
    """Take out the first packets of what waits, at ``most`` so many of one hop."""
    first = waiting.popleft()
    if first.packets > most:
        waiting.appendleft(first.part(most, first.packets - most))
        first = first.part(0, most)
    return first


class PacketQueue(Protocol):
    """The packets that wait for a radio."""

    def push(self, now_ns: int, packets: Waiting, inside: int) -> list[Dropped]:
        """Let packets of one hop wait, while others are ``inside`` the radio. Returns those that
        are dropped for it, of any hop."""

    def pop(self, now_ns: int, dropped: list[Dropped], takes: Takes) -> Waiting | None:
        """The packets of a hop that are sent next, which leave, as many as the radio ``takes`` in;
        None: nobody waits for whom it takes in more. Those that are dropped on that occasion are
        added to ``dropped``."""

    def take_out(self, dest: int | None) -> list[Waiting]:
        """All packets for this station alone (None: all), which leave."""


class PlainQueue:
    """The first to come is the first to go, as soon as the radio has room; what comes while
    ``limit`` packets wait, there or here, is dropped."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._waiting: deque[Waiting] = deque()
        self._packets = 0

    def push(self, now_ns: int, packets: Waiting, inside: int) -> list[Dropped]:
        count = packets.packets
        fit = max(min(self._limit - inside - self._packets, count), 0)
        if fit:
            self._packets += fit
            self._waiting.append(packets.part(0, fit))
        return [(packets.part(fit, count - fit), "queue_full")] if fit < count else []

    def pop(self, now_ns: int, dropped: list[Dropped], takes: Takes) -> Waiting | None:
        if not self._waiting:
            return None
        first = take_first(self._waiting, takes(None, 0))
        self._packets -= first.packets
        return first

    def take_out(self, dest: int | None) -> list[Waiting]:
        gone = [packets for packets in self._waiting if packets.only_for(dest)]
        self._waiting = deque(packets for packets in self._waiting if not packets.only_for(dest))
        self._packets -= sum(packets.packets for packets in gone)
        return gone
