"""The queues of a switch as records, for the compiled functions of ``kernels``."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from itertools import repeat
from typing import Generic, TypeVar

import numpy as np

from desim.ports.kernels import compiled_function
from netmodels.kernels import Addresses
from netmodels.switch.kernels import machine, records
from netmodels.switch.kernels.records import ALL_SENT, FULL, NEVER
from netmodels.switch.trains import PacketTrain

T = TypeVar("T")  # the sender's token of a frame

# A frame's fate at one exit: its token, after how many ns the last of its packets is at the
# receivers, and which packets are lost.
Fate = tuple[T, int, Sequence[int]]


class CompiledQueues(Generic[T]):
    """All interfaces and exits of a switch. ``hop_ns``: from a packet's end on one wire to its
    arrival at the other end of the cable. ``limit_ns``: what an exit may hold, as time on its wire.
    ``due_ns``: when the next frame will have been sent. A frame that will be in the switch within
    ``ahead_ns`` is not queued if no other is in its way.

    ``send(rows, now_ns, port, exit_, train)`` books a frame on a port's line, and returns the delay
    until it is at its receiver. Negative: that is not known, or it has several exits (``exit_`` is
    -1); ``put`` it.
    """

    def __init__(self, ports: int, hop_ns: int, limit_ns: int, fair: bool, ahead_ns: int,
                 local_ns: int) -> None:
        self.due_ns = NEVER
        self._fair = fair
        self.send = compiled_function(machine.send)
        self._send_many = compiled_function(machine.send_many)
        self._put = compiled_function(machine.put)
        self._wake = compiled_function(machine.wake)
        self._flows: dict[Hashable, int] = {}  # records; the first are the one flow of each port
        self._free_flows: list[int] = []
        self._tokens: dict[int, T] = {}  # of frames that wait, by record
        self._lost: dict[int, list[int]] = {}  # packets of those
        lines = np.zeros(ports, records.PORT)
        for name in ("waiting", "new", "old"):
            lines[name] = -1
        lines["sending"] = -1
        lines["end_ns"] = lines["due_ns"] = NEVER
        flows = np.zeros(ports, records.FLOW)
        flows["frames"] = -1
        self._own(records.Wires(
            np.array([(hop_ns, limit_ns, ahead_ns, local_ns, fair, -1, 0, 0, NEVER)],
                     records.SWITCH),
            lines, flows, np.zeros(0, records.FRAME), np.zeros(ports, records.EXIT),
            np.zeros((ports, 2 * records.MOST_SPANS), np.int64), np.zeros((ports, 3), np.int64),
            np.zeros(1, np.int64)))
        self._grow(4)

    def put(self, now_ns: int, port: int, flow: Hashable, train: PacketTrain,
            exits: Sequence[tuple[int, T]], unicast: bool) -> None:
        """Queue the frame that was booked last; each of its exits has a token of its own."""
        flow_record, put = self._flow(flow) if self._fair else port, self._put
        copy = -1
        for number, (exit_, token) in enumerate(exits, 1):
            while True:
                record, self.due_ns = put(
                    self.rows, now_ns, port, flow_record, exit_, copy, unicast,
                    number == len(exits), train)
                if record != FULL:
                    break
                self._grow()
            self._tokens[record] = token
            copy = record

    def send_many(self, now_ns: int, port: int, exits: np.ndarray, train: PacketTrain,
                  tokens: Callable[[Sequence[int]], Sequence[T]]) -> list[int | None]:
        """``send``, and where need be ``put``, frames to the ``exits`` [n]; ``tokens(places)`` are
        those of the frames at these places. Returns their delays, None where it is not known. Where
        flows are served in turn, it ends before the first that would have to be put."""
        count = len(exits)
        if count > len(self._state.many):
            self._own(self._state._replace(many=np.zeros(count, np.int64)))
        while True:
            self._state.many[:count] = exits
            taken, self.due_ns = self._send_many(self.rows, now_ns, port, count, train)
            if taken != FULL:
                break
            self._grow()
        many = self._state.many[:taken]
        delays: list[int | None] = many.tolist()
        places = (many < 0).nonzero()[0].tolist()
        for i, token in zip(places, tokens(places), strict=True):
            self._tokens[-1 - int(many[i])] = token
            delays[i] = None
        return delays

    def wake(self, now_ns: int) -> list[Fate[T]]:
        """Send up to now. Returns the fates of frames that have been sent, or will be soon."""
        wake = self._wake
        while True:
            noted, self.due_ns, record, packet, delay_ns = wake(self.rows, now_ns)
            if noted != FULL:
                break
            self._grow()
        if noted == 0:
            return []
        if noted == 1 and packet == ALL_SENT:  # as most often: no array is read
            return [(self._tokens.pop(record), delay_ns, self._lost.pop(record, ()))]
        notes = self._notes[:3 * noted].tolist()
        packets = notes[1::3]
        if not self._lost and max(packets) == ALL_SENT:
            return list(zip(map(self._tokens.pop, notes[::3]), notes[2::3], repeat(()),
                            strict=False))
        return self._fates(zip(notes[::3], packets, notes[2::3], strict=True))

    def left_ns(self, port: int) -> int:
        """The time when all that was sent to a port's line will have left it."""
        return int(self._state.ports["free_ns"][port])

    def departures_ns(self, fates: int) -> list[int]:
        """The times when the frames of the last ``wake``, with so many fates, left their
        interfaces."""
        notes = self._state.notes
        records = notes[notes[:, 1] == ALL_SENT, 0][:fates]
        departures: list[int] = self._state.frames["left_ns"][records].tolist()
        return departures

    def _fates(self, notes: Iterable[tuple[int, int, int]]) -> list[Fate[T]]:
        """The fates of frames of which packets may be lost."""
        fates: list[Fate[T]] = []
        for record, packet, delay_ns in notes:
            if packet == ALL_SENT:
                fates.append((self._tokens.pop(record), delay_ns, self._lost.pop(record, ())))
            else:
                self._lost.setdefault(record, []).append(packet)
        return fates

    def busy_ns(self, now_ns: int, ports: Sequence[int]) -> list[int]:
        """For how long there has been something on the wire, in either direction of ``ports``; a
        packet that is foreseen counts as if it were in the switch."""
        while not machine.run(self.rows, now_ns):
            self._grow()
        lines, exits = self._state.ports[ports], self._state.exits[ports]
        into = lines["booked_ns"] - np.maximum(lines["free_ns"] - now_ns, 0)
        begins_ns, ends_ns = self._state.spans[ports, ::2], self._state.spans[ports, 1::2]
        left_ns = np.maximum(ends_ns - np.maximum(begins_ns, now_ns), 0)
        left_ns[np.arange(records.MOST_SPANS) >= exits["spans"][:, None]] = 0
        return [*into.tolist(), *(exits["booked_ns"] - left_ns.sum(axis=1)).tolist()]

    def _own(self, state: records.Wires) -> None:
        """Work on these arrays, and try out the future on copies."""
        self._state = state
        self._arrays = Addresses(state, records.Wires(*(array.copy() for array in state)))
        self.rows = self._arrays.rows
        self._notes = state.notes.ravel().data  # read in a third of numpy's time

    def _grow(self, frames: int = 0) -> None:
        """Make room for twice as many frames and notes."""
        state, switch = self._state, self._state.switch[0]
        old, more = len(state.frames), frames or len(state.frames)
        new = np.zeros(more, records.FRAME)
        new["next"] = [*range(old + 1, old + more), switch["free"]]
        switch["free"] = old
        switch["room"] += more
        notes = np.zeros((len(state.notes) + more, 3), np.int64)
        self._own(state._replace(frames=np.concatenate([state.frames, new]),
                                 notes=np.concatenate([state.notes, notes])))

    def _flow(self, name: Hashable) -> int:
        """The record of a flow; a new one if it has none."""
        record = self._flows.get(name)
        if record is None:
            if not self._free_flows:
                self._collect()
            record = self._flows[name] = self._free_flows.pop()
        return record

    def _collect(self) -> None:
        """Free the records of flows that are in no list, or make more."""
        flows = self._state.flows
        idle = flows["listed"] == 0
        self._free_flows = [record for record in self._flows.values() if idle[record]]
        self._flows = {name: record for name, record in self._flows.items() if not idle[record]}
        if len(self._free_flows) < len(self._flows) + 1:
            more = np.zeros(len(flows), records.FLOW)
            more["frames"] = -1
            self._free_flows += range(len(flows), 2 * len(flows))
            self._own(self._state._replace(flows=np.concatenate([flows, more])))
