"""Partitions of the fleet: episodes in which some robot cannot be reached over any others."""

from __future__ import annotations

import numpy as np

from desim.units import NS_PER_S


def components(linked: np.ndarray) -> int:
    """The number of connected parts of n points, of which ``linked`` [n, n] bool has the pairs."""
    left = np.ones(len(linked), bool)
    parts = 0
    while left.any():
        part = np.zeros(len(linked), bool)
        front = part.copy()
        front[np.argmax(left)] = True
        while front.any():
            part |= front
            front = linked[front].any(axis=0) & ~part
        left &= ~part
        parts += 1
    return parts


class Partitions:
    """Counts episodes during which the fleet is in parts, as of the instants of ``sample``.

    It is in parts where no chain of its robots, over links that could carry a frame now, joins some
    two of them. A robot whose host is down is in no part and in no chain.
    """

    def __init__(self) -> None:
        self.parts = 1
        self.most_parts = 1
        self.episodes: list[tuple[int, int]] = []
        self._since_ns: int | None = None

    @property
    def count(self) -> int:
        """Episodes that have begun."""
        return len(self.episodes) + (self._since_ns is not None)

    def sample(self, now_ns: int, linked: np.ndarray | None) -> bool:
        """Note the present parts; true where an episode begins now. ``linked`` [n, n] bool: the
        pairs of robots that are up between which frames get, None: all."""
        self.parts = 1 if linked is None or len(linked) < 2 else components(linked)
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
