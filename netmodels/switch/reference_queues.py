"""The queues of a switch, packet by packet, in plain Python: the reference for compiled ones.

A port's line serves flows by deficit round robin, new ones first (Linux sch_fq_codel.c): each may
send ``QUANTUM_BYTES`` in its turn. With one flow a port that is first in, first out.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable, Iterable
from typing import Generic, NamedTuple, TypeVar

from netmodels.switch.kernels import NEVER, QUANTUM_BYTES
from netmodels.switch.trains import PacketTrain

T = TypeVar("T")  # the sender's token of a frame



class ExitFate(NamedTuple):
    """The fate of a frame at one exit: when the last of its packets left, and which are lost."""

    out_ns: int
    lost: tuple[int, ...]


# An exit: until when it is busy, for how long it has been in all, when the last packet came.
Load = tuple[int, int, int]


class _QueuedTrain(Generic[T]):
    """A frame that waits in a line or is being sent."""

    def __init__(self, token: T, train: PacketTrain, exits: tuple[int, ...]) -> None:
        self.token, self.train, self.exits = token, train, exits
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
    arrival at the other end of the cable."""

    def __init__(self, ports: int, hop_ns: int, limit_ns: int) -> None:
        self._lines: list[InterfaceQueue[T]] = [InterfaceQueue() for _ in range(ports)]
        self._exits: list[Load] = [(0, 0, 0)] * ports
        self._hop_ns = hop_ns
        self._limit_ns = limit_ns
        self._done: list[tuple[T, list[ExitFate]]] = []

    def load(self, exit_: int, load: Load) -> None:
        self._exits[exit_] = load

    def loaded(self, exit_: int) -> Load:
        return self._exits[exit_]

    def put(self, port: int, begin_ns: int, flow: Hashable, train: PacketTrain,
            exits: Iterable[int], token: T) -> None:
        """A frame to send; ``begin_ns`` is when the line is free if nothing waits."""
        line = self._lines[port]
        line.put(flow, _QueuedTrain(token, train, tuple(exits)))
        if line.sending is None:
            line.next(begin_ns)

    def due_ns(self, port: int) -> int:
        """The time to ``run`` next for this port, unless something else is put there."""
        return self._lines[port].end_ns

    def run(self, now_ns: int) -> None:
        """Send up to now. Of packets that end at once the lower port's is the first."""
        lines = self._lines
        while True:
            line = min(lines, key=lambda one: one.end_ns)
            frame, end_ns = line.sending, line.end_ns
            if frame is None or end_ns > now_ns:
                return
            self._cross(frame, end_ns + self._hop_ns)
            if frame.begun == frame.train.packets:
                self._done.append((frame.token, [
                    ExitFate(out_ns, tuple(lost))
                    for out_ns, lost in zip(frame.outs, frame.lost, strict=True)]))
            line.next(end_ns)

    def finished(self) -> list[tuple[T, list[ExitFate]]]:
        """The frames of which all packets have been sent since the last call: token, and the fate
        at each of its exits."""
        done, self._done = self._done, []
        return done

    def _cross(self, frame: _QueuedTrain[T], at_ns: int) -> None:
        """A packet is in the switch, and joins the queue of each of its exits, first in, first
        out."""
        number = frame.begun - 1
        wire_ns = frame.train.wire_ns(number)
        for k, exit_ in enumerate(frame.exits):
            free_ns, booked_ns, _ = self._exits[exit_]
            if at_ns < free_ns and free_ns - at_ns + wire_ns > self._limit_ns:
                frame.lost[k].append(number)
                continue
            frame.outs[k] = max(at_ns, free_ns) + wire_ns
            self._exits[exit_] = frame.outs[k], booked_ns + wire_ns, at_ns
