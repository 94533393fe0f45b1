"""CSMA/CD of IEEE 802.3, clause 4: carrier sense, collision detection, binary exponential backoff.

All hosts are equally far from each other. A host that begins before the first sender's signal has
arrived collides with it; each hears the other one after the propagation time, jams and stops. All
see the bus idle when the last signal has passed everybody, and waiting hosts begin a gap later. No
packet is shorter than a slot, and a slot is longer than a round trip, so that no collision goes
unheard.

Simpler than the standard: a host that hears a collision during its preamble does not finish that.
"""

from __future__ import annotations

from desim import ports
from netmodels.bus.stations import BusStation, BusStations, Cable

SLOT_BITS = 512  # IEEE 802.3, table 4-2: slotTime, jamSize, attemptLimit, backoffLimit
JAM_BITS = 32
_ATTEMPTS = 16
_CEILING = 10


class CollisionDetection(BusStations):
    """Carrier sense with collision detection and binary exponential backoff."""

    def __init__(self, cable: Cable, context: ports.Context, hosts: tuple[str, ...]) -> None:
        super().__init__(cable, context, hosts)
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
            self._context.at(stop_ns, self._abort, station)
            return
        slots = int(station.random() * (1 << min(station.attempts, _CEILING)))
        self._context.at(stop_ns + slots * self._cable.slot_ns, self._try, station)

    def _abort(self, station: BusStation) -> None:
        self._give_up(station, "excessive_collisions")
