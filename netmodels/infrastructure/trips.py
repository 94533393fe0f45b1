"""Frames on their way over access points and wires."""

from __future__ import annotations

from collections.abc import Hashable

from desim import ports
from netmodels.hops import HopLedger, HopPart
from netmodels.journeys import Journey

QUEUED = frozenset({"queue_full", "codel"})  # reasons of queues


class Trip(Journey):
    """A frame of the medium on its way, or a copy of a broadcast on a part of it. ``flow``: what
    queues take it for; ``dscp``: its mark. ``gone``: packets that are lost, by reason, the last of
    them at the station ``lost_at``. ``parts``: of its time up to ``since_ns``, where there is a
    ledger."""

    def __init__(self, frame: ports.Frame, flow: Hashable, since_ns: int, dscp: int = 0) -> None:
        super().__init__(frame)
        self.flow, self.since_ns, self.dscp = flow, since_ns, dscp
        self.parts: list[HopPart] = []
        self.gone: dict[str, list[int]] = {}
        self.lost_at = frame.source

    def lose(self, lost: dict[int, str], station: int, where: str = "") -> None:
        """Go on without packets that are ``lost`` at a station, by their number among those that
        were left; ``where`` a queue was full, if not at the sender."""
        for reason, packets in self.without(lost).items():
            name = f"{where}_{reason}" if where and reason in QUEUED else reason
            self.gone.setdefault(name, []).extend(packets)
            self.lost_at = station

    def copy(self) -> Trip:
        """Another one that goes on from here."""
        other = Trip(self.frame, self.flow, self.since_ns, self.dscp)
        other.left, other.parts, other.lost_at = self.left, [*self.parts], self.lost_at
        other.gone = {reason: [*packets] for reason, packets in self.gone.items()}
        return other


class TripTimes:
    """Enters the parts of trips' times in the medium's ``ledger``, from those that radios and wires
    enter in theirs."""

    def __init__(self, ledger: ports.Ledger) -> None:
        self._ledger = ledger
        self.air, self.wires = HopLedger(ledger, True), HopLedger(ledger, True)

    def hop(self, trip: Trip, station: int, leg: ports.Frame | None, on: HopLedger,
            arrives_ns: int, receiver: int | None = None) -> None:
        """A hop of a trip from a ``station`` is over, at one ``receiver`` or at its only one,
        ``leg`` being the last frame of it."""
        parts: list[HopPart] = []
        if leg is not None:
            parts = [(ports.TimePart.QUEUE, on.begun_ns(leg) - trip.since_ns, leg.source),
                     *on.parts(leg, arrives_ns, receiver)]
        rest_ns = arrives_ns - trip.since_ns - sum(time_ns for _, time_ns, _ in parts)
        if rest_ns:
            parts.append((ports.TimePart.QUEUE, rest_ns, station))
        trip.parts += parts
        trip.since_ns = arrives_ns

    def end(self, trip: Trip, receiver: int) -> None:
        """A trip is about to be settled at a receiver."""
        if trip.left:
            for part, time_ns, at in trip.parts:
                self._ledger.spent(trip.frame, part, time_ns, receiver, at)
        if trip.gone:
            self._ledger.lost_at(trip.frame, trip.lost_at, receiver)
