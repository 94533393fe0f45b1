"""A queue for each station in front of a radio, as Linux's mac80211 has them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from netmodels.infrastructure.fq_codel import FqCodel
from netmodels.infrastructure.packet_queue import Dropped, Receivers, Waiting


class StationQueues:
    """An FQ-CoDel for each station, and one for broadcasts. They take turns: one has its turn until
    the radio takes in no more for its station, or nothing is left (ieee80211_next_txq). Limits of
    packets and bytes are those of one station, where Linux has them for all."""

    def __init__(self, queue: Callable[[], FqCodel]) -> None:
        self._new_queue = queue
        self._queues: dict[Receivers, FqCodel] = {}
        self._turns: deque[Receivers] = deque()

    def push(self, now_ns: int, packets: Waiting, inside: int) -> list[Dropped]:
        receivers = packets.hop.receivers
        if receivers not in self._queues:
            self._queues[receivers] = self._new_queue()
        if receivers not in self._turns:
            self._turns.append(receivers)
        return self._queues[receivers].push(now_ns, packets.singly())

    def pop(self, now_ns: int, dropped: list[Dropped], takes: Callable[[Receivers], bool],
            most: int) -> Waiting | None:
        for _ in range(len(self._turns)):
            receivers = self._turns[0]
            if takes(receivers):
                packet = self._queues[receivers].pop(now_ns, dropped)
                if packet is not None:
                    return packet
                self._turns.popleft()
            else:
                self._turns.rotate(-1)
        return None

    def take_out(self, dest: int | None) -> list[Waiting]:
        return [packet for queue in self._queues.values() for packet in queue.take_out(dest)]
