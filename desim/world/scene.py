"""The matter of one instant beside the robots."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Scene(NamedTuple):
    """The part of a snapshot besides poses: ``walls`` [n, 4] that beams meet, ``fixed`` of them the
    terrain's and then closed doors, all ``tops_m`` [n] high; ``discs`` [m, 3] of moving obstacles;
    of each kind of odometer that reckons the poses [robots, 3]."""

    walls: np.ndarray
    tops_m: np.ndarray
    fixed: int
    discs: np.ndarray
    reckoned: tuple[np.ndarray | None, ...]
