"""FQ-CoDel: a queue for each flow, which are served in turn (RFC 8290)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable, Iterator, Sequence

from pydantic import Field

from desim import ports
from desim.units import ByteSize, Period
from netmodels.infrastructure.codel import CoDel
from netmodels.infrastructure.packet_queue import Dropped, Waiting

_BATCH = 32  # packets that are dropped at once where there are too many (fq_impl.h, fq_flow_drop)


class FqCodelConstants(ports.Constants):
    """Those of Linux's Wi-Fi (net/mac80211/tx.c, ieee80211_txq_setup_flows; include/net/fq_impl.h,
    fq_init). As a qdisc FQ-CoDel has 5 ms, 100 ms, 1514 B twice, 10 240 packets, 32 MB (RFC 8290).
    """

    target_ns: Period = Field("20 ms", description="that packets may wait (mac80211)")
    interval_ns: Period = Field("100 ms", description="for which they may wait longer (mac80211)")
    quantum_bytes: ByteSize = Field("300 B", ge=1, description="of a flow in its turn (mac80211)")
    spare_bytes: ByteSize = Field("0 B", description=(
        "of a flow behind a packet that is not dropped, whatever it has waited for (mac80211: no "
        "codel_params.mtu)"))
    limit: int = Field(8192, ge=1, description="packets of all flows (mac80211)")
    memory_bytes: ByteSize | None = Field(None, description=(
        "of packets of all flows (mac80211: 16 MB; 4 MB for radios without VHT. Linux counts their "
        "buffers, which are larger by driver)"))


def memory_bytes(standard: str) -> int:
    """The limit for all packets that wait for a radio (ieee80211_txq_setup_flows)."""
    return (16 if standard in ("11ac", "11ax") else 4) << 20


class _Flow(CoDel):
    """A flow's packets, the bytes that it may still send in its turn, and whether it has turns.
    """

    deficit_bytes = 0
    has_turns = False


class Backlog:
    """The packets that wait in all queues of a radio (struct fq): their limits are for all. Where
    there are too many, the flow with the most bytes loses half of its packets from the head, 32 at
    most. ``packets``, their ``bytes``, and the ``flows`` of all queues may be looked at."""

    def __init__(self, limit: int, limit_bytes: int) -> None:
        self._limit, self._limit_bytes = limit, limit_bytes
        self.flows: list[_Flow] = []
        self.packets = self.bytes = 0

    def count(self, packets: int, size_bytes: int) -> None:
        """Packets have come, or (negative) left."""
        self.packets += packets
        self.bytes += size_bytes

    def has_room(self, packets: Waiting) -> bool:
        """Whether none is too many of these."""
        return (self.packets + packets.packets <= self._limit
                and self.bytes + packets.size_bytes <= self._limit_bytes)

    def thin_out(self) -> list[Dropped]:
        """Drop packets if there are too many."""
        if self.packets <= self._limit and self.bytes <= self._limit_bytes:
            return []
        fattest = max(self.flows, key=lambda flow: flow.bytes)
        waiting = sum(packets.packets for packets in fattest.waiting)
        dropped: list[Dropped] = []
        for _ in range(max(min(waiting // 2, _BATCH), 1)):
            packet = fattest.take_first()
            self.count(-1, -packet.size_bytes)
            dropped.append((packet, "queue_full"))
        return dropped


class FqCodel:
    """Flows take turns by deficit round robin, those that have just begun first; each is a CoDel,
    which knows of its last drops when it begins again. No two flows share a queue, and nothing is
    marked instead of dropped. Queues of a radio share its ``backlog`` (None: only this one)."""

    def __init__(self, constants: FqCodelConstants, backlog: Backlog | None = None) -> None:
        self._constants = constants
        self._backlog = backlog or Backlog(
            constants.limit, constants.memory_bytes or memory_bytes("11ac"))
        self._flows: dict[Hashable, _Flow] = {}
        self._new: deque[Hashable] = deque()
        self._old: deque[Hashable] = deque()

    def push(self, now_ns: int, packets: Sequence[Waiting]) -> list[Dropped]:
        constants = self._constants
        dropped: list[Dropped] = []
        for packet in self._within_limits(packets):
            name = packet.hop.trip.flow, packet.hop.receivers
            flow = self._flows.get(name)
            if flow is None:
                flow = self._flows[name] = _Flow(
                    constants.target_ns, constants.interval_ns, constants.spare_bytes)
                self._backlog.flows.append(flow)
            if not flow.has_turns:
                flow.has_turns, flow.deficit_bytes = True, constants.quantum_bytes
                self._new.append(name)
            flow.push(packet)
            self._backlog.count(packet.packets, packet.size_bytes)
            dropped += self._backlog.thin_out()
        return dropped

    def pop(self, now_ns: int, dropped: list[Dropped],
            takes: Callable[[int], int] = lambda size_bytes: 1) -> Waiting | None:
        """``takes``: of packets of so many bytes, how many may leave together."""
        while self._new or self._old:
            turns = self._new or self._old
            name = turns[0]
            flow = self._flows[name]
            if flow.deficit_bytes <= 0:
                flow.deficit_bytes += self._constants.quantum_bytes
                self._old.append(turns.popleft())
                continue
            before, most = len(dropped), 1
            if flow.waiting and len(self._new) + len(self._old) == 1:
                most = takes(flow.waiting[0].longest_bytes)
            packets = flow.pop(now_ns, dropped, most)
            for gone, _ in dropped[before:]:
                self._backlog.count(-1, -gone.size_bytes)
            if packets is None:
                turns.popleft()
                if turns is self._new and self._old:
                    self._old.append(name)  # so that it is not new again at once
                else:
                    flow.has_turns = False
                continue
            self._backlog.count(-packets.packets, -packets.size_bytes)
            if packets.packets > 1:
                self._take_turns(flow, packets)
            else:
                flow.deficit_bytes -= packets.size_bytes
            return packets
        return None

    def take_out(self, dest: int | None) -> list[Waiting]:
        gone = []
        for flow in self._flows.values():
            for _ in range(len(flow.waiting)):
                packets = flow.take_first(flow.waiting[0].packets)
                if packets.only_for(dest):
                    gone.append(packets)
                    self._backlog.count(-packets.packets, -packets.size_bytes)
                else:
                    flow.push(packets)
        return gone

    def _take_turns(self, flow: _Flow, packets: Waiting) -> None:
        """Let the only flow that has turns send packets, and take the next turn whenever one is
        over before the last of them."""
        quantum, first = self._constants.quantum_bytes, packets.number
        deficit, sizes = flow.deficit_bytes, packets.hop.sizes[first:first + packets.packets]
        for size_bytes in sizes[:-1]:
            deficit -= size_bytes
            if deficit <= 0:
                deficit += quantum * (-deficit // quantum + 1)  # turns until it is above 0
                self._old.extend(self._new)
                self._new.clear()
        flow.deficit_bytes = deficit - sizes[-1]

    def _within_limits(self, packets: Sequence[Waiting]) -> Iterator[Waiting]:
        """The packets one by one where there may be too many, else as they come."""
        for some in packets:
            if self._backlog.has_room(some):
                yield some
            else:
                yield from some.singly()
