"""One clock for a recording, whose stamps may be those of several."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from desim.units import NS_PER_S

APART_NS = 31 * 86_400 * NS_PER_S  # stamps farther from all others are those of another clock
_LAST_NS = 1 << 62  # beyond it, an instant of a record is damaged


class RecordingClock:
    """Dates the content of a recording.

    Its clock is that of most stamps of what moves: wall time, or a simulator's. What has no stamp,
    or one of another clock, is dated by when it was recorded, counted from the record before it
    that has a stamp of the clock.
    """

    def __init__(self) -> None:
        self._rows: list[tuple[int, int, bool, Callable[[int], object]]] = []

    def add(self, stamp_ns: int, record_ns: int, moving: bool, put: Callable[[int], object]
            ) -> None:
        """Have ``put`` called with the instant of a row; ``stamp_ns`` 0 is none."""
        self._rows.append((stamp_ns, min(record_ns, _LAST_NS), moving, put))

    def settle(self) -> int:
        """Date all rows. Returns how many stamps are of another clock."""
        moving = np.array([(stamp, record) for stamp, record, moves, _ in self._rows
                           if moves and stamp], np.int64).reshape(-1, 2)
        moving = moving[np.argsort(moving[:, 1], kind="stable")]
        low, high = _most(np.sort(moving[:, 0]))
        known = moving[(moving[:, 0] >= low) & (moving[:, 0] <= high)]
        others = 0
        for stamp_ns, record_ns, _, put in self._rows:
            if stamp_ns and low - APART_NS <= stamp_ns <= high + APART_NS:
                put(stamp_ns)
            elif len(known):
                before = max(int(np.searchsorted(known[:, 1], record_ns, side="right")) - 1, 0)
                put(int(known[before, 0]) + record_ns - int(known[before, 1]))
            else:
                put(record_ns)
            others += bool(stamp_ns and not low - APART_NS <= stamp_ns <= high + APART_NS)
        self._rows = []
        return others


def _most(stamps_ns: np.ndarray) -> tuple[int, int]:
    """The first and the last of the most stamps (ascending) that have no gap between them."""
    if not len(stamps_ns):
        return 0, -1
    parts = np.split(stamps_ns, np.flatnonzero(np.diff(stamps_ns) > APART_NS) + 1)
    most = max(parts, key=len)
    return int(most[0]), int(most[-1])
