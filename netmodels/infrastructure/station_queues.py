"""A queue for each station in front of a radio, as Linux's mac80211 has them."""

from __future__ import annotations

from collections import deque
from functools import partial

from netmodels.infrastructure.fq_codel import Backlog, FqCodel, FqCodelConstants
from netmodels.infrastructure.packet_queue import Dropped, Receivers, Takes, Waiting


class StationQueues:
    """An FQ-CoDel for each station, and one for broadcasts. They take turns: one has its turn until
    the radio takes in no more for its station, or nothing is left (ieee80211_next_txq)."""

    def __init__(self, constants: FqCodelConstants, backlog: Backlog) -> None:
        """``backlog``: of all queues of a radio, which its limits are for."""
        self._constants, self._backlog = constants, backlog
        self._queues: dict[Receivers, FqCodel] = {}
        self._turns: deque[Receivers] = deque()

    def push(self, now_ns: int, packets: Waiting, inside: int) -> list[Dropped]:
        receivers = packets.hop.receivers
        if receivers not in self._queues:
            self._queues[receivers] = FqCodel(self._constants, self._backlog)
        if receivers not in self._turns:
            self._turns.append(receivers)
        return self._queues[receivers].push(now_ns, (packets,))

    def pop(self, now_ns: int, dropped: list[Dropped], takes: Takes) -> Waiting | None:
        for _ in range(len(self._turns)):
            receivers = self._turns[0]
            if takes(receivers, 0):
                packets = self._queues[receivers].pop(now_ns, dropped, partial(takes, receivers))
                if packets is not None:
                    return packets
                self._turns.popleft()
            else:
                self._turns.rotate(-1)
        return None

    def take_out(self, dest: int | None) -> list[Waiting]:
        return [packet for queue in self._queues.values() for packet in queue.take_out(dest)]
