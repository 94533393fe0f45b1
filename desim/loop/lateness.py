"""The lateness of real frames: the clock of the programs against that of the model."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

LATE_NS = 1_000_000  # a frame that is later counts as late
MAX_LATE_SHARE = 0.01  # of a run on the wall clock that is valid: our choice


class Lateness(NamedTuple):
    """Median, 99th percentile and maximum, all in us, and the share of frames that were late."""

    p50_us: float
    p99_us: float
    max_us: float
    late_share: float

    @property
    def valid(self) -> bool:
        """Whether so few frames were late that the times of the run mean something."""
        return self.late_share <= MAX_LATE_SHARE


def lateness_of(late_ns: list[int]) -> Lateness | None:
    """The lateness of frames; None if there were none."""
    if not late_ns:
        return None
    all_ns = np.array(late_ns)
    p50, p99, most = (np.percentile(all_ns, [50, 99, 100]) / 1e3).round(3).tolist()
    return Lateness(p50, p99, most, round(float((all_ns > LATE_NS).mean()), 6))
