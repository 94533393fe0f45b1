"""The part of the plane that a recording's terrain covers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from desim.results.source import ReplaySource
from desim.units import MM_PER_M


class Extent(NamedTuple):
    """A rectangle along the axes, in m."""

    left_m: float
    bottom_m: float
    right_m: float
    top_m: float

    @property
    def side_m(self) -> float:
        """The longer side, at least 1 m."""
        return max(self.right_m - self.left_m, self.top_m - self.bottom_m, 1.0)

    @property
    def middle_m(self) -> tuple[float, float]:
        return (self.left_m + self.right_m) / 2, (self.bottom_m + self.top_m) / 2


def extent_of(recording: ReplaySource) -> Extent | None:
    """The extent of all walls; of all poses where there is no wall; None: neither has anything."""
    walls = np.array([wall[2:6] for wall in recording.walls], np.int64)
    places = walls.reshape(-1, 2) if len(walls) else recording.poses.xy_mm.reshape(-1, 2)
    if not len(places):
        return None
    low, high = places.min(0) / MM_PER_M, places.max(0) / MM_PER_M
    return Extent(*low.tolist(), *high.tolist())
