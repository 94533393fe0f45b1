"""The hops that trips are made of: up to an access point, along the wires, down to stations."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import partial

from desim import ports
from netmodels.hops import Hops
from netmodels.infrastructure.outlets import AirHop, AirOutlet
from netmodels.infrastructure.power_save import PowerSave
from netmodels.infrastructure.trips import Trip, TripTimes

# Called with a trip and the station where it is now; of its packets none may be left.
There = Callable[[Trip, int], object]


class Ways:
    """Carries trips over single hops, and settles them at the end. ``outlets`` are those of all
    stations of ``air``."""

    def __init__(self, context: ports.Context, air: Hops, wires: Hops, outlets: Sequence[AirOutlet],
                 times: TripTimes | None, power_save: PowerSave | None) -> None:
        self._context, self._air, self._wires = context, air, wires
        self._outlets, self._times, self._power_save = outlets, times, power_save

    def up(self, trip: Trip, access_point: int, there: There) -> None:
        """From its source to the access point of that."""
        if self._power_save is not None:
            self._power_save.active(trip.frame.source)
        self._outlets[trip.frame.source].take(AirHop(
            trip, (access_point,), False, partial(self._came_up, there)))

    def along(self, trip: Trip, station: int, dests: tuple[int, ...], there: There) -> None:
        """Over the wires from a station to others; a copy comes to each."""
        self._wires.send(station, dests, trip.size_bytes(), len(trip.left), len(dests) > 1,
                         partial(self._came_along, trip, there), trip.frame.id)

    def down(self, trip: Trip, access_point: int, receiver: int) -> None:
        """From an access point to one of its stations, where it ends."""
        self._outlets[access_point].take(AirHop(
            trip, (receiver,), False, partial(self._came_down, access_point, (receiver,))))

    def broadcast(self, trip: Trip, access_point: int, stations: tuple[int, ...],
                  receivers: Collection[int]) -> None:
        """From an access point to all of its stations; it ends at those that are meant."""
        hop = AirHop(trip, stations, True, partial(self._came_down, access_point, receivers))
        if self._power_save is None or not self._power_save.hold(access_point, hop):
            self._outlets[access_point].take(hop)

    def stop(self, trip: Trip, station: int, reason: str, receivers: Sequence[int]) -> None:
        """All that is left of a trip is lost at a station, on the way to these receivers."""
        trip.lose(dict.fromkeys(range(len(trip.left)), reason), station)
        self.end(trip, receivers)

    def end(self, trip: Trip, receivers: Sequence[int]) -> None:
        """Settle a trip at some receivers: what is left of it has come there now."""
        if not receivers:
            return
        frame, settle = trip.frame, self._context.settle_many
        if self._times is not None:
            for receiver in receivers:
                self._times.end(trip, receiver)
        whole = not trip.left and len(trip.gone) == 1
        for reason, packets in trip.gone.items():
            settle(frame, receivers, ports.Drop(reason, None if whole else tuple(packets)))
        if trip.left:
            settle(frame, receivers, ports.Deliver(0))

    def _came_up(self, there: There, hop: AirHop, leg: ports.Frame | None) -> None:
        trip, (access_point,) = hop.trip, hop.receivers
        self._context.left(trip.frame)
        if self._times is not None:
            self._times.hop(trip, trip.frame.source, leg, self._times.air, self._context.now_ns)
        trip.lose(hop.lost[access_point], trip.frame.source)
        if trip.left:
            there(trip, access_point)
        else:
            self.end(trip, trip.frame.receivers)

    def _came_along(self, trip: Trip, there: There, leg: ports.Frame, dests: Sequence[int],
                    verdict: ports.Deliver | ports.Drop, lost: dict[int, str]) -> None:
        now_ns = self._context.now_ns
        arrives_ns = now_ns
        if isinstance(verdict, ports.Drop):
            lost = dict.fromkeys(range(len(trip.left)), verdict.reason) | lost
        else:
            arrives_ns += verdict.delay_ns
        for dest in dests:
            copy = trip.copy()
            if self._times is not None:
                self._times.hop(copy, leg.source, leg, self._times.wires, arrives_ns, dest)
            copy.lose(lost, leg.source, "wires")
            self._context.at(arrives_ns, lambda arrived: there(*arrived), (copy, dest))

    def _came_down(self, access_point: int, meant: Collection[int], hop: AirHop,
                   leg: ports.Frame | None) -> None:
        trip = hop.trip
        if self._times is not None:
            self._times.hop(trip, access_point, leg, self._times.air, self._context.now_ns)
        if self._power_save is not None and not hop.broadcast:
            self._power_save.active(hop.receivers[0])
        receivers = [receiver for receiver in hop.receivers if receiver in meant]
        whole = [receiver for receiver in receivers if not hop.lost[receiver]]
        if whole:
            self.end(trip, whole)
        for receiver in receivers:
            if hop.lost[receiver]:
                copy = trip.copy()
                copy.lose(hop.lost[receiver], access_point, "downlink")
                self.end(copy, (receiver,))
