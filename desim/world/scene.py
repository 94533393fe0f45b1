"""The matter of one instant beside the robots."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Scene(NamedTuple):
    """The part of a snapshot besides poses.

    ``walls`` [n, 4] that beams meet, first ``fixed`` ones of the terrain, then closed doors |
    ``tops_m`` [n] their heights | ``discs`` [m, 3], first ``movers`` of moving obstacles, then of
    people | ``reckoned`` for each kind of odometer the poses [robots, 3] of its dead reckoning,
    None if it does none.
    """

    walls: np.ndarray
    tops_m: np.ndarray
    fixed: int
    discs: np.ndarray
    movers: int
    reckoned: tuple[np.ndarray | None, ...]
