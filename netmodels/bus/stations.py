"""Stations that compete for a bus: each has a queue and sends its packets one by one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from desim import ports
from netmodels.drop_tail import refuse
from netmodels.partial_trains import settle_without


class Cable(NamedTuple):
    """The properties of the bus. ``wire_ns(size_bytes)`` is the time that a packet takes without
    its gap."""

    propagation_ns: int
    gap_ns: int
    slot_ns: int
    jam_ns: int
    queue_packets: int
    wire_ns: Callable[[int], int]


class Packet(NamedTuple):
    """A packet in a station's queue."""

    frame: ports.Frame
    wire_ns: int
    number: int  # in its frame, from 0
    last: bool  # of those that were let in


class BusStation:
    """A sender: the packets that wait, and the one that it is sending or wants to send."""

    def __init__(self, random: Callable[[], float]) -> None:
        self.random = random  # uniform in [0, 1)
        self.queue: deque[Packet] = deque()
        self.packet: Packet  # once it has had any
        self.attempts = 0  # to send this packet, so far
        self.idle = True
        self.lost: dict[str, list[int]] = {}  # packets of the present frame, by reason


class BusStations(ABC):
    """The common part of carrier sense with and without collisions. Subclasses have ``_try``, which
    sends a station's packet now or books another try, and set ``free_ns``, before which nobody can
    begin. ``taken_ns``: for how long that has been so, up to then."""

    def __init__(self, cable: Cable, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._cable = cable
        self._context = context
        self.transmissions = self.collisions = 0
        self.free_ns = self.taken_ns = 0
        self._arrive = ports.Deliver(cable.propagation_ns)
        self._stations = [BusStation(context.stream("backoff", host).random) for host in hosts]

    def take(self, frame: ports.Frame) -> None:
        station, cable = self._stations[frame.source], self._cable
        free = cable.queue_packets - len(station.queue) + station.idle
        sizes = ports.packet_sizes(frame.size_bytes, frame.segments)[:free]
        refuse(self._context, frame, len(sizes))
        station.queue.extend(Packet(frame, cable.wire_ns(size_bytes), number, number + 1 == free
                                    or number + 1 == frame.segments)
                             for number, size_bytes in enumerate(sizes))
        if station.idle:
            self._next(station)

    def _next(self, station: BusStation) -> None:
        station.idle = not station.queue
        if station.queue:
            station.packet = station.queue.popleft()
            station.attempts = 0
            self._try(station)

    @abstractmethod
    def _try(self, station: BusStation) -> None: ...

    def _sent(self, station: BusStation) -> None:
        """The last bit has left the station."""
        self._passed(station)
        self._context.at(self._context.now_ns + self._cable.gap_ns, self._next, station)

    def _give_up(self, station: BusStation, reason: str) -> None:
        """Drop the station's packet, and go on to the next one."""
        station.lost.setdefault(reason, []).append(station.packet.number)
        self._passed(station)
        self._next(station)

    def _passed(self, station: BusStation) -> None:
        """A packet has left the queue; the last one of a frame settles it."""
        frame, _, number, last = station.packet
        if not last:
            return
        lost, station.lost = station.lost, {}
        if lost:
            for receiver in frame.receivers:
                settle_without(self._context, frame, receiver, lost, self._arrive, number + 1)
        else:
            self._context.settle_many(frame, frame.receivers, self._arrive)
