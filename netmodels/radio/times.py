"""The parts of the time that frames spend with radios, for ledgers."""

from __future__ import annotations

from collections.abc import Sequence

from desim.ports import Frame, Ledger, TimePart
from netmodels.radio.dcf.stations import Stations


class AirTimes:
    """Enters in ``ledgers``, one of each radio with its ``hosts``, the parts of frames' time: from
    when a frame gets a place in a station's queue, and from what the stations keep of it."""

    def __init__(self, ledgers: Sequence[Ledger], hosts: int, stations: Stations) -> None:
        self._ledgers, self._hosts, self._stations = ledgers, hosts, stations
        self._taken_ns: dict[tuple[int, int], int] = {}  # by station and place in its queue

    def taken(self, station: int, position: int, now_ns: int) -> None:
        """A frame gets a place."""
        self._taken_ns[station, position] = now_ns

    def over(self, station: int, position: int, frame: Frame) -> None:
        """A frame leaves its place now."""
        first_ns, _, contended_ns, sent_ns, repeated_ns = self._stations.times(station)
        ledger = self._ledgers[self._stations.radios[station] // self._hosts]
        waited_ns = first_ns - self._taken_ns.pop((station, position))
        if waited_ns < 0:  # it joined others: what was spent on them before it came is not its own
            contended_ns, repeated_ns, sent_ns = _without(-waited_ns, contended_ns, repeated_ns,
                                                          sent_ns)
            waited_ns = 0
        for part, time_ns in (
                (TimePart.QUEUE, waited_ns), (TimePart.CONTENTION, contended_ns),
                (TimePart.RETRANSMISSION, repeated_ns), (TimePart.AIRTIME, sent_ns)):
            ledger.spent(frame, part, time_ns)


def _without(past_ns: int, *parts_ns: int) -> list[int]:
    """The rest of the parts, one after the other, behind their first ``past_ns``."""
    left = []
    for part_ns in parts_ns:
        passed_ns = min(past_ns, part_ns)
        past_ns -= passed_ns
        left.append(part_ns - passed_ns)
    return left
