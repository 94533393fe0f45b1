"""The blacklist of goals that a robot avoids for a while, or for good (explore_lite's)."""

from __future__ import annotations

import math

import numpy as np

from desim.scenario.schema.robot import ExplorationParams


class Blacklist:
    """Cells around which no goal is chosen, each for a limited time or for good."""

    def __init__(self, exploration: ExplorationParams, across: int, resolution_m: float) -> None:
        self._for_ns = exploration.blacklist_for_ns
        self._radius = exploration.blacklist_radius_m / resolution_m
        self._across = across
        self._entries: list[tuple[int, int, float]] = []  # row, column, until (ns, or infinity)

    def add(self, cell: int, now_ns: int) -> None:
        """Avoid the surroundings of ``cell`` from now on."""
        until_ns = math.inf if self._for_ns is None else now_ns + self._for_ns
        self._entries.append((*divmod(cell, self._across), until_ns))

    def expire(self, now_ns: int) -> None:
        """Forget the entries whose time is over."""
        self._entries = [entry for entry in self._entries if entry[2] > now_ns]

    def has_expired(self, now_ns: int) -> bool:
        """Whether the time of an entry is over."""
        return any(until_ns <= now_ns for _, _, until_ns in self._entries)

    def discs(self) -> np.ndarray:
        """The avoided discs [k, 3] for searches: row, column and squared radius in cells."""
        within2 = int(self._radius**2 + 1e-6)  # 0.6 m are three cells of 0.2 m, and not 2.9999
        return np.array([(row, column, within2)
                         for row, column, _ in self._entries], np.int64).reshape(-1, 3)
