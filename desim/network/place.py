"""Where the hosts of a medium are, and what stands between them."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from desim.ports import Obstacles


class Place(Protocol):
    """Where the hosts are, and what stands between them."""

    obstacles: Obstacles

    def positions(self, time_ns: int) -> np.ndarray: ...


def _no_crossings(segments: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    return np.empty((0, 2), np.int64)


class Nowhere:
    """The place of hosts that have none: positions are NaN, nothing is in the way."""

    def __init__(self, hosts: int) -> None:
        self._positions = np.full((hosts, 2), np.nan)
        self._positions.flags.writeable = False
        nothing = np.empty(0)
        self.obstacles = Obstacles(np.empty((0, 4)), nothing.astype(np.int64), nothing, nothing,
                                   (), 0, _no_crossings)

    def positions(self, time_ns: int) -> np.ndarray:
        return self._positions


class Still(Nowhere):
    """The place of hosts that stay where they are, in the open: ``positions`` [hosts, 2] x, y in m
    (NaN: it has none)."""

    def __init__(self, positions: np.ndarray) -> None:
        super().__init__(len(positions))
        self._positions = positions
        self._positions.flags.writeable = False
