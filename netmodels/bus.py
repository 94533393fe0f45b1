"""A shared bus: one cable for all hosts, and who may send next on it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple

from pydantic import Field

from desim import ports
from desim.errors import InputError
from desim.ports import TimePart
from desim.units import NS_PER_S, BitRate, ByteSize, Duration, airtime_ns
from netmodels.ethernet import padded
from netmodels.itemized import FrameTimes, Itemized
from netmodels.partial_trains import settle_without
from netmodels.queues import DropTailQueue, refuse

SLOT_BITS = 512  # IEEE 802.3, table 4-2: slotTime, jamSize, attemptLimit, backoffLimit
JAM_BITS = 32
_ATTEMPTS = 16
_CEILING = 10

# ns-3's class Backoff: slots of 1 us, 1 to 1000 of them, doubled ten times, given up after 1000
# times.
_NS3_SLOT_NS = 1000
_NS3_MOST_SLOTS = 1000
_NS3_CEILING = 10
_NS3_ATTEMPTS = 1000


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
        self.lost: list[int] = []  # packets of the present frame


class BusStations(ABC):
    """The common part of carrier sense with and without collisions. Subclasses have ``_try``, which
    sends a station's packet now or books another try, and set ``free_ns``, before which nobody can
    begin. ``taken_ns``: for how long that has been so, up to then. ``_gives_up`` is the reason why
    a packet is lost."""

    _gives_up: str

    def __init__(self, cable: Cable, context: ports.Context, hosts: tuple[str, ...],
                 ledger: ports.Ledger) -> None:
        self._cable = cable
        self._context = context
        self._ledger, self._times = ledger, FrameTimes.of(ledger)
        self.transmissions = self.collisions = 0
        self.free_ns = self.taken_ns = 0
        self._arrive = ports.Deliver(cable.propagation_ns)
        self._stations = [BusStation(context.stream("backoff", host).random) for host in hosts]

    def take(self, frame: ports.Frame) -> None:
        station, cable = self._stations[frame.source], self._cable
        free = cable.queue_packets - len(station.queue) + station.idle
        sizes = ports.packet_sizes(frame.size_bytes, frame.segments)[:free]
        refuse(self._context, frame, len(sizes))
        if sizes:
            self._times.begin(frame, self._context.now_ns)
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
            if station.packet.number == 0:
                self._stamp(station, TimePart.QUEUE)
            self._try(station)

    @abstractmethod
    def _try(self, station: BusStation) -> None: ...

    def _stamp(self, station: BusStation, part: TimePart, now_ns: int | None = None) -> None:
        """A station's packet has been in ``part`` until now."""
        self._times.until(station.packet.frame, part,
                          self._context.now_ns if now_ns is None else now_ns)

    def _sent(self, station: BusStation) -> None:
        """The last bit has left the station."""
        self._stamp(station, TimePart.AIRTIME)
        self._passed(station)
        self._context.at(self._context.now_ns + self._cable.gap_ns, self._next, station)

    def _give_up(self, station: BusStation) -> None:
        """Drop the station's packet, and go on to the next one."""
        self._stamp(station, TimePart.RETRANSMISSION)
        station.lost.append(station.packet.number)
        self._passed(station)
        self._next(station)

    def _passed(self, station: BusStation) -> None:
        """A packet has left the queue; the last one of a frame settles it."""
        frame, _, number, last = station.packet
        if not last:
            return
        lost, station.lost = station.lost, []
        self._times.end(frame)
        self._ledger.spent(frame, TimePart.PROPAGATION, self._cable.propagation_ns)
        if lost:
            for receiver in frame.receivers:
                settle_without(self._context, frame, receiver, {self._gives_up: lost}, self._arrive,
                               number + 1)
        else:
            self._context.settle_many(frame, frame.receivers, self._arrive)


class CarrierSense(BusStations):
    """Carrier sense without collisions, as in ns-3's CsmaNetDevice.

    A station knows the state of the bus at once, wherever it is. If the bus is busy it asks again
    after a random number of slots from a range that doubles with each time. Only the host that has
    sent waits for the gap, so that others may begin in it. The bus stays busy while a packet
    propagates.
    """

    _gives_up = "excessive_backoff"

    def _try(self, station: BusStation) -> None:
        """Send, or draw the next try: all draws that fall into the time that the bus is certain to
        be busy are made at once."""
        now_ns = self._context.now_ns
        if now_ns >= self.free_ns:
            self.transmissions += 1
            self._stamp(station, TimePart.CONTENTION)
            end_ns = now_ns + station.packet.wire_ns
            self.free_ns = end_ns + self._cable.propagation_ns
            self.taken_ns += self.free_ns - now_ns
            self._context.at(end_ns, self._sent, station)
            return
        while now_ns < self.free_ns:
            if station.attempts == _NS3_ATTEMPTS:
                self._context.at(now_ns, self._give_up, station)
                return
            station.attempts += 1
            most = min((1 << min(station.attempts, _NS3_CEILING)) - 1, _NS3_MOST_SLOTS)
            now_ns += int(1 + station.random() * (most - 1)) * _NS3_SLOT_NS
        self._context.at(now_ns, self._try, station)


class CollisionDetection(BusStations):
    """CSMA/CD of IEEE 802.3, clause 4: carrier sense, collision detection, binary exponential
    backoff.

    All hosts are equally far from each other. A host that begins before the first sender's signal
    has arrived collides with it; each hears the other one after the propagation time, jams and
    stops. All see the bus idle when the last signal has passed everybody, and waiting hosts begin a
    gap later. No packet is shorter than a slot, and a slot is longer than a round trip, so that no
    collision goes unheard.

    Simpler than the standard: a host that hears a collision during its preamble does not finish
    that.
    """

    _gives_up = "excessive_collisions"

    def __init__(self, cable: Cable, context: ports.Context, hosts: tuple[str, ...],
                 ledger: ports.Ledger) -> None:
        super().__init__(cable, context, hosts, ledger)
        # That have begun, unheard so far, and when.
        self._senders: list[tuple[BusStation, int]] = []

    def _try(self, station: BusStation) -> None:
        now_ns = self._context.now_ns
        if now_ns < self.free_ns:
            self._context.at(self.free_ns, self._try, station)
            return
        if not self._senders:
            self._context.at(now_ns + self._cable.propagation_ns, self._all_hear)
        self._senders.append((station, now_ns))

    def _all_hear(self, _: None) -> None:
        """The first sender's signal is everywhere: nobody else will begin."""
        senders, self._senders = self._senders, []
        station, first_ns = senders[0]
        for one, begun_ns in senders:  # after a collision, this is another attempt
            self._stamp(one, TimePart.RETRANSMISSION if one.attempts else TimePart.CONTENTION,
                        begun_ns)
        self.transmissions += len(senders)
        if len(senders) == 1:
            end_ns = first_ns + station.packet.wire_ns
            self._occupy(first_ns, end_ns)
            self._context.at(end_ns, self._sent, station)
            return
        self.collisions += len(senders)
        heard_ns = self._cable.propagation_ns + self._cable.jam_ns
        stop_ns = senders[1][1] + heard_ns
        self._occupy(first_ns, stop_ns)
        self._collided(station, stop_ns)
        for other, _begun_ns in senders[1:]:
            self._collided(other, first_ns + heard_ns)

    def _occupy(self, begin_ns: int, end_ns: int) -> None:
        """The bus carries a signal from ``begin_ns`` to ``end_ns``."""
        self.free_ns = end_ns + self._cable.propagation_ns + self._cable.gap_ns
        self.taken_ns += self.free_ns - begin_ns

    def _collided(self, station: BusStation, stop_ns: int) -> None:
        station.attempts += 1
        if station.attempts == _ATTEMPTS:
            self._context.at(stop_ns, self._give_up, station)
            return
        slots = int(station.random() * (1 << min(station.attempts, _CEILING)))
        self._context.at(stop_ns + slots * self._cable.slot_ns, self._try, station)


class Fifo:
    """One common queue: frames have the bus in the order in which they were sent. A perfect
    arbiter, which the other disciplines are measured against."""

    def __init__(self, cable: Cable, context: ports.Context, hosts: tuple[str, ...],
                 ledger: ports.Ledger) -> None:
        self._cable = cable
        self._context, self._ledger = context, ledger
        self.free_ns = self.taken_ns = 0
        self._line = DropTailQueue(cable.queue_packets)
        self.departures_ns = [0] * len(hosts)
        self.transmissions = self.collisions = 0

    def take(self, frame: ports.Frame) -> None:
        cable, now_ns = self._cable, self._context.now_ns
        sizes = ports.packet_sizes(frame.size_bytes, frame.segments)
        begin_ns = max(now_ns, self.free_ns)
        fit = self._line.join(now_ns, begin_ns, cable.wire_ns(sizes[0]) + cable.gap_ns, len(sizes))
        refuse(self._context, frame, fit)
        if not fit:
            return
        self.transmissions += fit
        self.free_ns = begin_ns + sum(map(cable.wire_ns, sizes[:fit])) + fit * cable.gap_ns
        self.taken_ns += self.free_ns - begin_ns
        self.departures_ns[frame.source] = self.free_ns
        arrives_ns = self.free_ns - cable.gap_ns + cable.propagation_ns
        spent = self._ledger.spent
        spent(frame, TimePart.QUEUE, begin_ns - now_ns)
        spent(frame, TimePart.AIRTIME, self.free_ns - cable.gap_ns - begin_ns)
        spent(frame, TimePart.PROPAGATION, cable.propagation_ns)
        self._context.settle_many(frame, frame.receivers, ports.Deliver(arrives_ns - now_ns))


Arbitration = CarrierSense | CollisionDetection | Fifo
Discipline = Callable[[Cable, ports.Context, tuple[str, ...], ports.Ledger], Arbitration]
ARBITRATIONS: dict[str, Discipline] = {
    "csma": CarrierSense, "csma_cd": CollisionDetection, "fifo": Fifo}


class Bus(Itemized):
    """One cable for all hosts, one packet at a time; a broadcast is one transmission.

    With ``csma`` and ``csma_cd`` a train competes for the bus packet by packet, and one that is
    given up is lost alone; with ``fifo`` it goes in one go.

    A packet that finds ``queue_packets`` waiting is dropped, and of a train all those for which the
    queue has no place.

    Capabilities: Refuses, CountsAttempts, CountsBusyTime, Itemizes; with ``fifo``, KnowsDepartures.
    """

    class Params(ports.Params):
        arbitration: Literal["csma", "csma_cd", "fifo"] = Field(
            "csma_cd", description="who sends next: without collisions as in ns-3, as in IEEE "
                                   "802.3, or in order of sending (IEEE 802.3)")
        rate_bps: BitRate = Field("10 Mb/s", description="of the bus (10BASE5)")
        propagation_ns: Duration = Field("1 us", description="between any two hosts (200 m at "
                                                             "2e8 m/s)")
        queue_packets: int = Field(100, ge=1, description="that wait at a sender, or with fifo in "
                                                          "all, beside the one that is being sent "
                                                          "(ns-3 DropTailQueue)")
        preamble_bytes: ByteSize = Field("8 B", description="before each packet (IEEE 802.3; 0 B "
                                                            "in ns-3)")
        gap_bytes: ByteSize = Field("12 B", description="of silence after each packet: 9.6 us at "
                                                        "10 Mb/s (IEEE 802.3)")

    reasons = ("queue_full", "excessive_backoff", "excessive_collisions")
    refuses = ("queue_full",)

    def __init__(self, params: Params, discipline: Discipline | None = None) -> None:
        """``discipline`` arbitrates, instead of the one in ``params``."""
        self._params = params
        self._discipline = discipline or ARBITRATIONS[params.arbitration]
        if self._discipline is Fifo:
            self.departure_ns = self._departure_ns

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        """Raises ``InputError`` if collisions could go unheard."""
        params = self._params
        slot_ns, jam_ns, gap_ns = (-(-bits * NS_PER_S // params.rate_bps) for bits in (
            SLOT_BITS, JAM_BITS, 8 * params.gap_bytes))
        if params.arbitration == "csma_cd" and 2 * params.propagation_ns + jam_ns > slot_ns:
            raise InputError(f".propagation: twice {params.propagation_ns} ns and the jam of "
                             f"{jam_ns} ns must fit into a slot of 512 bits, {slot_ns} ns at this "
                             "rate")
        cable = Cable(params.propagation_ns, gap_ns, slot_ns, jam_ns, params.queue_packets,
                      self._wire_ns)
        self._context = context
        self._arbitration = self._discipline(cable, context, hosts, self._ledger)

    def send(self, frame: ports.Frame) -> None:
        self._arbitration.take(frame)

    def attempts(self) -> tuple[int, int]:
        """The number of packets begun so far, and how many of them collided."""
        return self._arbitration.transmissions, self._arbitration.collisions

    def busy_ns(self, hosts: Sequence[int]) -> list[int]:
        """For how long nobody could begin: a host was sending (with success or not), a signal was
        under way, or the gap behind it was not over (``csma``: only the sender waits for that)."""
        bus = self._arbitration
        return [bus.taken_ns - max(bus.free_ns - self._context.now_ns, 0)]

    def _departure_ns(self, host: int) -> int:
        """``ports.KnowsDepartures``, of fifo."""
        assert isinstance(self._arbitration, Fifo)
        return self._arbitration.departures_ns[host]

    def _wire_ns(self, size_bytes: int) -> int:
        params = self._params
        return airtime_ns(padded(size_bytes) + params.preamble_bytes, params.rate_bps)
