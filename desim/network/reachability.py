"""Reachability: the pairs of hosts between which a medium lets frames get."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from desim.network.answer_checks import Plugin, reach_m_of
from desim.network.place import Surroundings
from desim.ports import Separates


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
