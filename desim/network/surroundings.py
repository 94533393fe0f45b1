"""A medium's view of the world: places of hosts, obstacles, and who can reach whom."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from desim.network.answer_checks import Plugin, reach_m_of
from desim.ports import Antennas, Obstacles, Separates


class Surroundings(Protocol):
    """The places of hosts, and what stands between them."""

    @property
    def obstacles(self) -> Obstacles:
        """The obstacles at the present geometry epoch."""

    @property
    def antennas(self) -> Antennas:
        """See ``ports.RuleContext``."""

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
        self.antennas = Antennas.plain(hosts)

    def positions(self, time_ns: int) -> np.ndarray:
        return self._positions


class Still(Nowhere):
    """Hosts that stay where they are, in the open: ``positions`` [hosts, 2] x, y in m (NaN: a host
    without a place)."""

    def __init__(self, positions: np.ndarray) -> None:
        super().__init__(len(positions))
        self._positions = positions
        self._positions.flags.writeable = False


class Reachability:
    """Reachability as far as ``parts``, the rules and the network model, know it."""

    def __init__(self, parts: Sequence[Plugin], place: Surroundings) -> None:
        self._place = place
        self._reach_m = min(reach_m_of(part) for part in parts)
        self._separators = [part.separates for part in parts if isinstance(part, Separates)]

    def links(self, hosts: np.ndarray, now_ns: int) -> np.ndarray | None:
        """[k, k] bool: between which of ``hosts`` [k] (indices) frames can get; None: all."""
        links = None
        if self._reach_m < math.inf:
            places = self._place.positions(now_ns)[hosts]
            apart = places[:, None, :] - places[None, :, :]
            links = ~((apart ** 2).sum(axis=2) > self._reach_m ** 2)  # True for NaN
        for separates in self._separators:
            together = np.array([[not separates(a, b) for b in hosts.tolist()]
                                 for a in hosts.tolist()], bool)
            links = together if links is None else links & together
        return links
