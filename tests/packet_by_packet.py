"""A switch packet by packet, in plain Python: the reference for the compiled one.

A port's line serves flows by deficit round robin, new ones first (Linux sch_fq_codel.c): each may
send ``QUANTUM_BYTES`` in its turn. With one flow a port that is first in, first out.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable, Sequence
from typing import Generic, TypeVar

import numpy as np

from netmodels.switch import Switch
from netmodels.switch.compiled_queues import Fate
from netmodels.switch.kernels.records import NEVER, QUANTUM_BYTES
from netmodels.switch.trains import PacketTrain

T = TypeVar("T")  # the sender's token of a frame


class PacketByPacket(Switch):
    """The same switch, exact and slow. Capabilities: CountsBusyTime, Itemizes, SendsMany."""

    def start(self, context, hosts):
        super().start(context, hosts)
        self._queues = ReferenceQueues(max(self._port, default=0) + 1, self._hop_ns,
                                       self._limit_ns, self._fair)


class _QueuedTrain(Generic[T]):
    """A frame that waits in a line or is being sent."""

    def __init__(self, train: PacketTrain, exits: Sequence[tuple[int, T]]) -> None:
        self.train, self.exits = train, exits
        self.begun = 0  # packets
        self.outs = [0] * len(exits)
        self.lost: list[list[int]] = [[] for _ in exits]


class _FlowQueue(Generic[T]):
    """The frames of one flow."""

    def __init__(self) -> None:
        self.frames: deque[_QueuedTrain[T]] = deque()
        self.deficit = QUANTUM_BYTES


class InterfaceQueue(Generic[T]):
    """The queue of one port's interface."""

    def __init__(self) -> None:
        self.end_ns = NEVER  # of the packet that is being sent
        self.sending: _QueuedTrain[T] | None = None
        self._flows: dict[Hashable, _FlowQueue[T]] = {}
        self._new: deque[Hashable] = deque()
        self._old: deque[Hashable] = deque()

    def put(self, flow: Hashable, frame: _QueuedTrain[T]) -> None:
        if flow not in self._flows:
            self._flows[flow] = _FlowQueue()
            self._new.append(flow)
        self._flows[flow].frames.append(frame)

    def next(self, begin_ns: int) -> None:
        """Begin the next packet on the free line."""
        self.sending, self.end_ns = self._take(), NEVER
        if self.sending is not None:
            self.end_ns = begin_ns + self.sending.train.wire_ns(self.sending.begun - 1)

    def _take(self) -> _QueuedTrain[T] | None:
        while self._new or self._old:
            queue = self._new or self._old
            name = queue[0]
            flow = self._flows[name]
            if flow.deficit <= 0:
                flow.deficit += QUANTUM_BYTES
                self._old.append(queue.popleft())
            elif not flow.frames:
                queue.popleft()
                if queue is self._new and self._old:
                    self._old.append(name)
                else:
                    del self._flows[name]
            else:
                frame = flow.frames[0]
                flow.deficit -= frame.train.queue_bytes(frame.begun)
                frame.begun += 1
                if frame.begun == frame.train.packets:
                    flow.frames.popleft()
                return frame
        return None


class ReferenceQueues(Generic[T]):
    """All interfaces and exits of a switch. ``hop_ns``: from a packet's end on one wire to its
    arrival at the other end of the cable. ``limit_ns``: what an exit may hold, as time on its wire.
    """

    rows = None

    def __init__(self, ports: int, hop_ns: int, limit_ns: int, fair: bool) -> None:
        self._lines: list[InterfaceQueue[T]] = [InterfaceQueue() for _ in range(ports)]
        self._free_ns = [0] * ports  # when all will be sent
        self._booked_ns = [0] * ports  # how long that takes
        # Of exits: until when busy, for how long in all, since when without a pause.
        self._exits = [(0, 0, 0)] * ports
        self._hop_ns = hop_ns
        self._limit_ns = limit_ns
        self._fair = fair
        self._done: list[tuple[Fate[T], int]] = []  # and when the last of it left the interface
        self._departures_ns: list[int] = []

    @property
    def due_ns(self) -> int:
        """The time (ns) of the next ``wake``."""
        return min(line.end_ns for line in self._lines)

    def send(self, rows: None, now_ns: int, port: int, exit_: int, train: PacketTrain) -> int:
        """Book a frame on a port's line. Always negative: ``put`` it."""
        self._free_ns[port] = max(self._free_ns[port], now_ns) + train.total_ns
        self._booked_ns[port] += train.total_ns
        return -1

    def put(self, now_ns: int, port: int, flow: Hashable, train: PacketTrain,
            exits: Sequence[tuple[int, T]], unicast: bool) -> None:
        """Queue the frame that was booked last; each of its exits has a token of its own."""
        self._run(now_ns)
        line = self._lines[port]
        line.put(flow if self._fair else None, _QueuedTrain(train, exits))
        if line.sending is None:
            line.next(self._free_ns[port] - train.total_ns)

    def send_many(self, now_ns: int, port: int, exits: np.ndarray, train: PacketTrain,
                  token: Callable[[int], T]) -> list[int | None]:
        """Takes none of the frames: the caller sends each for itself."""
        return []

    def wake(self, now_ns: int) -> list[Fate[T]]:
        """Send up to now. Returns the fates of frames that have been sent."""
        self._run(now_ns)
        done, self._done = self._done, []
        self._departures_ns = [left_ns for _, left_ns in done]
        # A gap of the line may take longer than the cable.
        return [(token, max(arrival_ns - now_ns, 0), lost) for (token, arrival_ns, lost), _ in done]

    def left_ns(self, port: int) -> int:
        """The time when all that was sent to a port's line will have left it."""
        return self._free_ns[port]

    def departures_ns(self, fates: int) -> list[int]:
        """The times when the frames of the last ``wake``, with so many fates, left their
        interfaces."""
        return self._departures_ns

    def busy_ns(self, now_ns: int, ports: Sequence[int]) -> list[int]:
        """For how long there has been something on the wire, in either direction of ``ports``."""
        self._run(now_ns)
        into = [self._booked_ns[port] - max(self._free_ns[port] - now_ns, 0) for port in ports]
        out = [booked_ns - max(free_ns - max(begin_ns, now_ns), 0)
               for free_ns, booked_ns, begin_ns in (self._exits[port] for port in ports)]
        return into + out

    def _run(self, now_ns: int) -> None:
        """Send up to now. Of packets that end at once the lower port's is the first."""
        lines = self._lines
        while True:
            line = min(lines, key=lambda one: one.end_ns)
            frame, end_ns = line.sending, line.end_ns
            if frame is None or end_ns > now_ns:
                return
            self._cross(frame, end_ns + self._hop_ns)
            if frame.begun == frame.train.packets:
                self._done += [((token, out_ns + self._hop_ns, lost), end_ns)
                               for (_, token), out_ns, lost
                               in zip(frame.exits, frame.outs, frame.lost, strict=True)]
            line.next(end_ns)

    def _cross(self, frame: _QueuedTrain[T], at_ns: int) -> None:
        """A packet is in the switch, and joins the queue of each of its exits, first in, first
        out."""
        number = frame.begun - 1
        wire_ns = frame.train.wire_ns(number)
        for k, (exit_, _) in enumerate(frame.exits):
            free_ns, booked_ns, begin_ns = self._exits[exit_]
            if at_ns < free_ns and free_ns - at_ns + wire_ns > self._limit_ns:
                frame.lost[k].append(number)
                continue
            frame.outs[k] = max(at_ns, free_ns) + wire_ns
            self._exits[exit_] = (frame.outs[k], booked_ns + wire_ns,
                                  begin_ns if at_ns <= free_ns else at_ns)
