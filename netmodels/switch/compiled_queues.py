"""The queues of a switch as records, for the compiled functions of ``kernels.py``."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from typing import Generic, TypeVar

import numpy as np

from netmodels.kernels import Addresses
from netmodels.switch import kernels
from netmodels.switch.reference_queues import ExitFate, Load
from netmodels.switch.trains import PacketTrain

T = TypeVar("T")  # the sender's token of a frame


class CompiledQueues(Generic[T]):
    """The same as ``ReferenceQueues``, but by whole frames: ``due_ns`` is when the next frame will
    have been sent."""

    def __init__(self, ports: int, hop_ns: int, limit_ns: int) -> None:
        self._hop_ns = hop_ns
        self._limit_ns = limit_ns
        interfaces = np.full(ports, -1, kernels.INTERFACE)
        interfaces["end_ns"] = kernels.NEVER
        self._own(kernels.Queues(
            interfaces, np.full(2, -1, kernels.FLOW), np.full(4, -1, kernels.FRAME),
            np.zeros(ports, kernels.EXIT), np.full(4 + 2 * ports, -1, kernels.NOTE)))
        self._noted = 0
        self._free_flows = [1, 0]
        self._free_frames = [3, 2, 1, 0]
        self._names: list[dict[Hashable, int]] = [{} for _ in range(ports)]  # of flows
        self._queued = [0] * ports  # frames
        self._lost: dict[int, list[int]] = {}  # packets of frames that are not sent yet, by record
        self._tokens: dict[int, tuple[T, int, list[int]]] = {}  # with port and records, by frame

    def _own(self, queues: kernels.Queues) -> None:
        """Work on these arrays, and try out the future on copies."""
        self._queues = queues
        self._arrays = Addresses(queues, kernels.Queues(*(array.copy() for array in queues)))

    def load(self, exit_: int, load: Load) -> None:
        self._queues.exits[exit_] = load

    def loaded(self, exit_: int) -> Load:
        return self._queues.exits[exit_].item()

    def put(self, port: int, begin_ns: int, flow: Hashable, train: PacketTrain,
            exits: Iterable[int], token: T) -> None:
        """A frame to send; ``begin_ns`` is when the line is free if nothing waits."""
        records: list[int] = []
        copy = -1
        for exit_ in exits:
            if not self._free_frames:
                self._own(self._queues._replace(
                    frames=_longer(self._queues.frames, self._free_frames)))
            record = self._free_frames.pop()
            self._queues.frames[record] = (-1, *train[:6], 0, exit_, 0, 0, copy)
            records.append(record)
            copy = record
        self._tokens[copy] = token, port, records
        self._queued[port] += 1
        record = self._flow(port, flow)
        kernels.put(self._arrays.rows, port, begin_ns, record, copy)

    def due_ns(self, port: int) -> int:
        """The time to ``run`` next for this port, unless something else is put there."""
        return kernels.due_ns(self._arrays.rows, port)

    def run(self, now_ns: int) -> None:
        """Send up to now. Of packets that end at once the lower port's is the first."""
        while True:
            self._noted = kernels.run(self._arrays.rows, self._noted, now_ns, self._hop_ns,
                                      self._limit_ns)
            if self._noted >= 0:
                return
            self._noted = -1 - self._noted
            notes = self._queues.notes
            self._own(self._queues._replace(notes=np.concatenate([notes, notes])))

    def finished(self) -> list[tuple[T, list[ExitFate]]]:
        """The frames of which all packets have been sent since the last call: token, and the fate
        at each of its exits."""
        done, lost = [], self._lost
        for record, packet in self._queues.notes[:self._noted].tolist():
            if packet >= 0:
                lost.setdefault(record, []).append(packet)
                continue
            token, port, records = self._tokens.pop(record)
            done.append((token, [ExitFate(int(self._queues.frames[one]["out_ns"]),
                                         tuple(lost.pop(one, ()))) for one in records]))
            self._free_frames += records
            self._queued[port] -= 1
            if not self._queued[port]:  # its flows are in no list any more
                self._free_flows += self._names[port].values()
                self._names[port].clear()
        self._noted = 0
        return done

    def _flow(self, port: int, name: Hashable) -> int:
        """The record of a port's flow; a new one if it has none."""
        names = self._names[port]
        record = names.get(name)
        if record is None:
            if not self._free_flows:
                self._own(self._queues._replace(
                    flows=_longer(self._queues.flows, self._free_flows)))
            record = names[name] = self._free_flows.pop()
            self._queues.flows[record] = ((-1, -1), 0, -1, 0)
        return record


def _longer(records: np.ndarray, free: list[int]) -> np.ndarray:
    """Twice as many records; the new ones are added to ``free``."""
    count = len(records)
    free += range(2 * count - 1, count - 1, -1)
    return np.concatenate([records, np.full(count, -1, records.dtype)])
