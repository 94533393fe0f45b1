"""The reassembly of datagrams from IP fragments at a host, as in Linux."""

from __future__ import annotations

from collections import deque

from desim.middleware.jiffies import TICK_NS, fires_ns
from desim.middleware.udp.skb import truesize_bytes
from desim.ports import packet_sizes


class Reassembly:
    """The fragments of a host that wait for others of their datagrams.

    Those of a datagram that misses one keep their memory for ``time_ns`` as Linux's timers count it
    (30 to 32 s). While more than ``limit_bytes`` are kept no fragment is taken, be its datagram new
    or half there (``inet_frag_find``). So a datagram that crosses the limit is cut, and what has
    come of it fills the memory up to the limit.
    """

    __slots__ = ("_limit_bytes", "_time_ns", "_kept_bytes", "expiring")

    def __init__(self, limit_bytes: int, time_ns: int) -> None:
        self._limit_bytes, self._time_ns = limit_bytes, time_ns
        self._kept_bytes = 0
        # When, and how many bytes; empty: no fragment waits, as far as has been noticed.
        self.expiring: deque[tuple[int, int]] = deque()

    def take(self, now_ns: int, size_bytes: int, packets: int, each: int, lost: dict[int, str]
             ) -> dict[int, str]:
        """A train of datagrams of ``each`` packets arrives without the packets ``lost``. Returns
        those, and the packets that are not taken."""
        expiring = self.expiring
        while expiring and expiring[0][0] <= now_ns:
            self._kept_bytes -= expiring.popleft()[1]
        refused: dict[int, str] = {}
        sizes = packet_sizes(size_bytes, packets)
        for start in range(0, packets, each):
            datagram = range(start, min(packets, start + each))
            if len(datagram) == 1:
                continue
            room_bytes = self._limit_bytes - self._kept_bytes
            taken = memory = 0
            for number in datagram:
                if number in lost:
                    continue
                if memory > room_bytes:
                    refused[number] = "reassembly_full"
                else:
                    taken += 1
                    memory += truesize_bytes(sizes[number], 1)
            if 0 < taken < len(datagram):
                self._kept_bytes += memory
                expiring.append((fires_ns(now_ns, self._time_ns, TICK_NS), memory))
        return dict(sorted((lost | refused).items())) if refused else lost
