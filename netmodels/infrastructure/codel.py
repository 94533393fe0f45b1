"""CoDel, which drops packets that have waited too long for too long (RFC 8289)."""

from __future__ import annotations

from collections import deque
from math import sqrt

from netmodels.infrastructure.packet_queue import Dropped, Waiting, take_first

# Drops that ended so many intervals ago do not count in the rate of the next ones (RFC 8289, 5.4).
_RECENT_INTERVALS = 16


class CoDel:
    """A queue of packets in order. When packets have waited for ``target_ns`` or more during
    ``interval_ns``, one is dropped from its head, and then more, the n-th after another ``interval
    / sqrt(n)``, until one has waited for less or no more than ``spare_bytes`` are left (RFC 8289,
    section 5). ``waiting`` and their ``bytes`` may be looked at. Packets of one hop wait and leave
    together where each by itself would do the same."""

    def __init__(self, target_ns: int, interval_ns: int, spare_bytes: int) -> None:
        self._target_ns, self._interval_ns = target_ns, interval_ns
        self._spare_bytes = spare_bytes
        self.waiting: deque[Waiting] = deque()
        self.bytes = 0
        self._above_ns: int | None = None  # when they will have waited too long for an interval
        self._dropping = False
        self._drop_next_ns = 0
        self._count = self._last_count = 0

    def push(self, packets: Waiting) -> None:
        """Let packets wait."""
        self.waiting.append(packets)
        self.bytes += packets.size_bytes

    def take_first(self, most: int = 1) -> Waiting:
        """Take the packet at the head, whatever it has waited for; or at ``most`` so many."""
        packets = take_first(self.waiting, most)
        self.bytes -= packets.size_bytes
        return packets

    def pop(self, now_ns: int, dropped: list[Dropped], most: int = 1) -> Waiting | None:
        """The packet that leaves, or at ``most`` so many of one hop; those that are dropped before
        it are added to ``dropped``."""
        if most > 1 and not (self._above_ns is not None and now_ns >= self._above_ns):
            # None of this hop is dropped, and the last one counts.
            first = self._first(now_ns, most)
            self._dropping = False
            return first[0]
        packet, late = self._first(now_ns)
        if self._dropping:
            self._dropping = late
            while self._dropping and now_ns >= self._drop_next_ns and packet is not None:
                self._count += 1
                packet, late = self._instead(packet, now_ns, dropped)
                self._dropping = late
                if late:
                    self._drop_next_ns = self._law_ns(self._drop_next_ns)
        elif late and packet is not None:
            packet, _ = self._instead(packet, now_ns, dropped)
            self._dropping = True
            recent = self._count - self._last_count
            since_ns = now_ns - self._drop_next_ns
            self._count = recent if (
                recent > 1 and since_ns < _RECENT_INTERVALS * self._interval_ns) else 1
            self._last_count = self._count
            self._drop_next_ns = self._law_ns(now_ns)
        return packet

    def _instead(self, packet: Waiting, now_ns: int, dropped: list[Dropped]
                 ) -> tuple[Waiting | None, bool]:
        dropped.append((packet, "codel"))
        return self._first(now_ns)

    def _law_ns(self, from_ns: int) -> int:
        """The control law."""
        return from_ns + round(self._interval_ns / sqrt(self._count))

    def _first(self, now_ns: int, most: int = 1) -> tuple[Waiting | None, bool]:
        """The packets at the head, which leave, and whether waits have exceeded the target for an
        interval."""
        if not self.waiting:
            self._above_ns = None
            return None, False
        packet = self.take_first(most)
        if now_ns - packet.since_ns < self._target_ns or self.bytes <= self._spare_bytes:
            self._above_ns = None
            return packet, False
        if self._above_ns is None:
            self._above_ns = now_ns + self._interval_ns
            return packet, False
        return packet, now_ns >= self._above_ns
