"""The common part of models that tell where their frames' time goes (``ports.Itemizes``)."""

from __future__ import annotations

from desim.ports import Frame, Ledger, TimePart


class Itemized:
    """A model that tells the parts of its frames' time, if there is a ledger."""

    _ledger: Ledger | None = None

    def itemize(self, ledger: Ledger) -> None:
        """``ports.Itemizes``."""
        self._ledger = ledger


class FrameTimes:
    """Sums up the parts of frames' time from stamp to stamp, and tells them to ``ledger``."""

    def __init__(self, ledger: Ledger) -> None:
        self._ledger = ledger
        self._since_ns: dict[int, int] = {}  # by frame: its last stamp
        self._sums: dict[int, dict[TimePart, int]] = {}

    @classmethod
    def of(cls, ledger: Ledger | None) -> FrameTimes | None:
        """Those that a model needs."""
        return None if ledger is None else cls(ledger)

    def begin(self, frame: Frame, now_ns: int) -> None:
        """The model takes the frame."""
        self._since_ns[frame.id] = now_ns
        self._sums[frame.id] = {}

    def until(self, frame: Frame, part: TimePart, now_ns: int) -> None:
        """Since its last stamp the frame was in ``part``."""
        sums = self._sums[frame.id]
        sums[part] = sums.get(part, 0) + now_ns - self._since_ns[frame.id]
        self._since_ns[frame.id] = now_ns

    def end(self, frame: Frame) -> None:
        """It is about to be settled: tell its parts."""
        for part, time_ns in self._sums.pop(frame.id).items():
            self._ledger.spent(frame, part, time_ns)
        del self._since_ns[frame.id]
