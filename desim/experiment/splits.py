"""When is the fleet split: episodes in which not every robot can be reached over some others."""

from __future__ import annotations

import numpy as np

from desim.units import NS_PER_S


def components(positions: np.ndarray, reach_m: float) -> int:
    """Into how many parts points [n, 2] m fall when those within ``reach_m`` are connected."""
    steps = positions[:, None, :] - positions[None, :, :]
    near = (steps ** 2).sum(axis=2) <= reach_m ** 2
    left = np.ones(len(positions), bool)
    parts = 0
    while left.any():
        part = np.zeros(len(positions), bool)
        front = part.copy()
        front[np.argmax(left)] = True
        while front.any():
            part |= front
            front = near[front].any(axis=0) & ~part
        left &= ~part
        parts += 1
    return parts


class Splits:
    """Counts episodes during which the fleet is split, as seen at the instants of ``look``.

    ``reach_m`` None: everybody hears everybody, there are no episodes.
    """

    def __init__(self, reach_m: float | None) -> None:
        self.reach_m = reach_m
        self.parts = 1
        self.most_parts = 1
        self.episodes: list[tuple[int, int]] = []
        self._since_ns: int | None = None

    @property
    def count(self) -> int:
        """Episodes that have begun."""
        return len(self.episodes) + (self._since_ns is not None)

    def look(self, now_ns: int, positions: np.ndarray) -> bool:
        """Whether an episode begins now, with the fleet at ``positions`` [n, 2] m."""
        if self.reach_m is None or len(positions) < 2:
            return False
        self.parts = components(positions, self.reach_m)
        self.most_parts = max(self.most_parts, self.parts)
        if self.parts > 1 and self._since_ns is None:
            self._since_ns = now_ns
            return True
        if self.parts == 1:
            self.close(now_ns)
        return False

    def close(self, now_ns: int) -> None:
        """The open episode, if any, ends now."""
        if self._since_ns is not None:
            self.episodes.append((self._since_ns, now_ns))
            self._since_ns = None

    def summary(self) -> dict[str, object]:
        """Count and durations, after ``close``."""
        lengths_s = [(end - begin) / NS_PER_S for begin, end in self.episodes]
        return {"count": len(lengths_s), "total_s": sum(lengths_s, 0.0),
                "longest_s": max(lengths_s, default=0.0),
                "most_parts": self.most_parts,
                "episodes_s": [[begin / NS_PER_S, end / NS_PER_S]
                               for begin, end in self.episodes]}
