"""Carrier sense without collisions, as in ns-3's CsmaNetDevice.

A station knows the state of the bus at once, wherever it is. If the bus is busy it asks again
after a random number of slots from a range that doubles with each time. Only who has sent waits
for the gap, so that others may begin in it. The bus stays busy while a packet propagates.
"""

from __future__ import annotations

from netmodels.bus.stations import BusStation, BusStations

# ns-3's class Backoff: slots of 1 us, 1 to 1000 of them, doubled ten times, given up after 1000
# times.
_SLOT_NS = 1000
_MOST_SLOTS = 1000
_CEILING = 10
_ATTEMPTS = 1000


class CarrierSense(BusStations):
    """Carrier sense as in ns-3, without collisions."""

    def _try(self, station: BusStation) -> None:
        """Send, or draw the next try: all draws that fall into the time that the bus is certain to
        be busy are made at once."""
        now_ns = self._context.now_ns
        if now_ns >= self.free_ns:
            self.transmissions += 1
            end_ns = now_ns + station.packet.wire_ns
            self.free_ns = end_ns + self._cable.propagation_ns
            self.taken_ns += self.free_ns - now_ns
            self._context.at(end_ns, self._sent, station)
            return
        while now_ns < self.free_ns:
            if station.attempts == _ATTEMPTS:
                self._context.at(now_ns, self._abort, station)
                return
            station.attempts += 1
            most = min((1 << min(station.attempts, _CEILING)) - 1, _MOST_SLOTS)
            now_ns += int(1 + station.random() * (most - 1)) * _SLOT_NS
        self._context.at(now_ns, self._try, station)

    def _abort(self, station: BusStation) -> None:
        self._give_up(station, "excessive_backoff")
