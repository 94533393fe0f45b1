"""The places of a medium's hosts, and what stands between them."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from desim.ports import Obstacles


class Surroundings(Protocol):
    """The places of hosts, and what stands between them."""

    @property
    def obstacles(self) -> Obstacles:
        """The obstacles at the present geometry epoch."""

    def positions(self, time_ns: int) -> np.ndarray:
        """See ``ports.RuleContext``."""


def _no_crossings(segments: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    return np.empty((0, 2), np.int64)


class Nowhere:
    """Hosts without a place: positions are NaN, nothing is in the way."""

    def __init__(self, hosts: int) -> None:
        self._positions = np.full((hosts, 2), np.nan)
        self._positions.flags.writeable = False
        nothing = np.empty(0)
        self.obstacles = Obstacles(np.empty((0, 4)), nothing.astype(np.int64), nothing, nothing,
                                   (), 0, _no_crossings)

    def positions(self, time_ns: int) -> np.ndarray:
        return self._positions


class Still(Nowhere):
    """Hosts that stay where they are, in the open: ``positions`` [hosts, 2] x, y in m (NaN: a host
    without a place)."""

    def __init__(self, positions: np.ndarray) -> None:
        super().__init__(len(positions))
        self._positions = positions
        self._positions.flags.writeable = False
