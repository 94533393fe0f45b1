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
        ledger = self._ledgers[station // self._hosts]
        early_ns = self._taken_ns.pop((station, position)) - first_ns
        ledger.spent(frame, TimePart.QUEUE, max(-early_ns, 0))
        for part, time_ns in ((TimePart.CONTENTION, contended_ns),
                              (TimePart.RETRANSMISSION, repeated_ns), (TimePart.AIRTIME, sent_ns)):
            # What a frame joined that was sent with those before it was on the way by then.
            passed_ns = min(max(early_ns, 0), time_ns)
            early_ns -= passed_ns
            ledger.spent(frame, part, time_ns - passed_ns)
