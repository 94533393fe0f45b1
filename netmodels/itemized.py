"""The capability ``ports.Itemizes`` for models of this package: the parts of frames' time."""

from __future__ import annotations

from desim.ports import Frame, Ledger, TimePart


class NoLedger(Ledger):
    """The ledger of a run that keeps none."""

    def spent(self, frame: Frame, part: TimePart, time_ns: int, receiver: int | None = None,
              host: int | None = None) -> None:
        pass

    def lost_at(self, frame: Frame, host: int, receiver: int | None = None) -> None:
        pass


NO_LEDGER = NoLedger()


class Itemized:
    """A network model that enters its frames' times in a ledger."""

    _ledger: Ledger = NO_LEDGER

    def itemize(self, ledger: Ledger) -> None:
        """Enter the times of frames in ``ledger`` from now on (``ports.Itemizes``)."""
        self._ledger = ledger


class FrameTimes:
    """Stopwatches of frames: each ``until`` ends one part, and ``end`` enters all in the ledger."""

    def __init__(self, ledger: Ledger) -> None:
        self._ledger = ledger
        self._since_ns: dict[int, int] = {}  # by frame: its last stamp
        self._sums: dict[int, dict[TimePart, int]] = {}

    @classmethod
    def of(cls, ledger: Ledger) -> FrameTimes:
        """Stopwatches for this ledger."""
        return NoTimes(ledger) if ledger is NO_LEDGER else cls(ledger)

    def begin(self, frame: Frame, now_ns: int) -> None:
        """The model takes the frame: its first part begins."""
        self._since_ns[frame.id] = now_ns
        self._sums[frame.id] = {}

    def until(self, frame: Frame, part: TimePart, now_ns: int) -> None:
        """The frame was in ``part`` since its last stamp."""
        sums = self._sums[frame.id]
        sums[part] = sums.get(part, 0) + now_ns - self._since_ns[frame.id]
        self._since_ns[frame.id] = now_ns

    def end(self, frame: Frame) -> None:
        """The frame is about to be settled: enter its parts."""
        for part, time_ns in self._sums.pop(frame.id).items():
            self._ledger.spent(frame, part, time_ns)
        del self._since_ns[frame.id]


class NoTimes(FrameTimes):
    """Stopwatches that nobody reads."""

    def begin(self, frame: Frame, now_ns: int) -> None:
        pass

    def until(self, frame: Frame, part: TimePart, now_ns: int) -> None:
        pass

    def end(self, frame: Frame) -> None:
        pass
