"""Broadcasts: up to an access point, and down from all of them."""

from __future__ import annotations

from desim import ports
from netmodels.infrastructure.associations import Associations
from netmodels.infrastructure.memberships import Memberships
from netmodels.infrastructure.trips import Trip
from netmodels.infrastructure.ways import Ways

ENDED = "membership_ended"  # the reason of multicasts to who is no known member
_NOBODY = ports.Drop("receiver_not_associated")


class _Flood:
    """A broadcast: the receivers where it has not gone yet, and the copies that are to come to a
    station."""

    def __init__(self, receivers: tuple[int, ...], coming: int) -> None:
        self.left, self.coming = dict.fromkeys(receivers), coming

    def leave_out(self, receivers: list[int]) -> None:
        """Send no more of it to these receivers."""
        for receiver in receivers:
            del self.left[receiver]

    def reaches(self, stations: list[int]) -> list[int]:
        """Those of ``stations`` where it has to go and has not been, which it reaches now."""
        reached = [station for station in stations if station in self.left]
        for station in reached:
            del self.left[station]
        return reached


class Floods:
    """Sends broadcasts from access points: each sends to all of its stations, and wires carry a
    copy to each other access point and to the wired receivers. ``multicast`` is that of
    ``Settings``."""

    def __init__(self, context: ports.Context, ways: Ways, associations: Associations,
                 access_points: tuple[int, ...], wired: frozenset[int], multicast: str,
                 memberships: Memberships) -> None:
        self._context, self._ways, self._associations = context, ways, associations
        self._access_points, self._wired = access_points, wired
        self._multicast, self._memberships = multicast, memberships

    def spread(self, trip: Trip, station: int) -> None:
        """A broadcast is at ``station``, an access point or its wired sender."""
        receivers = trip.frame.receivers
        others = [*(one for one in receivers if one in self._wired), *self._access_points]
        along = tuple(one for one in others if one != station)
        flood = _Flood(receivers, len(along) + (station in self._access_points))
        ended = [one for one in receivers
                 if self._memberships.ended(one, self._context.now_ns)]
        if ended:
            flood.leave_out(ended)
            self._ways.stop(trip.copy(), station, ENDED, ended)
        if along:
            self._ways.along(trip.copy(), station, along,
                             lambda copy, at: self._there(flood, copy, at))
        if station in self._access_points:
            self._there(flood, trip, station)

    def _there(self, flood: _Flood, trip: Trip, station: int) -> None:
        flood.coming -= 1
        if not self._associations.runs(station):
            pass  # nobody gets it from there
        elif station in self._wired:
            self._ways.end(trip, flood.reaches([station]))
        else:
            members = self._associations.members(station)
            meant = flood.reaches(members)
            if not trip.left:
                self._ways.end(trip, meant)
            elif self._multicast == "unicast":
                for receiver in meant:
                    self._ways.down(trip.copy(), station, receiver)
            elif meant or members and self._multicast == "flood":
                self._ways.broadcast(trip, station, tuple(members), meant)
        if not flood.coming and flood.left:
            self._context.settle_many(trip.frame, list(flood.left), _NOBODY)
