"""Partitions of the fleet: episodes in which some robot cannot be reached over any others."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from desim.monitor.meters.meter import Due, Meter, Second
from desim.monitor.samples import Sample
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


class Partitions(Meter):
    """Counts episodes during which the fleet is in parts, as of full seconds.

    It is in parts where no chain of its robots, over links that could carry a frame now, joins some
    two of them. A robot whose host is down is in no part and in no chain. ``began`` gets the number
    of parts where an episode begins.
    """

    def __init__(self, began: Callable[[int], object]) -> None:
        self._began = began
        self._parts = self._most_parts = 1
        self._episodes: list[tuple[int, int]] = []
        self._since_ns: int | None = None

    def each_second(self, second: Second) -> None:
        linked = second.linked
        self._parts = 1 if linked is None or len(linked) < 2 else components(linked)
        self._most_parts = max(self._most_parts, self._parts)
        if self._parts > 1 and self._since_ns is None:
            self._since_ns = second.now_ns
            self._began(self._parts)
        elif self._parts == 1 and self._since_ns is not None:
            self._episodes.append((self._since_ns, second.now_ns))
            self._since_ns = None

    def quantities(self, now_ns: int) -> Sample:
        """Episodes that have begun."""
        return {"partitions": len(self._episodes) + (self._since_ns is not None)}

    def sample(self, now_ns: int, due: Due) -> Sample:
        return {"parts": self._parts}

    def summary(self, now_ns: int) -> Sample:
        """Count and durations; an open episode lasts until now."""
        open_ = [] if self._since_ns is None else [(self._since_ns, now_ns)]
        episodes_s = [[begin / NS_PER_S, end / NS_PER_S] for begin, end in self._episodes + open_]
        lengths_s = [(end - begin) / NS_PER_S for begin, end in self._episodes + open_]
        return {"partitions": {"count": len(lengths_s), "total_s": sum(lengths_s, 0.0),
                               "longest_s": max(lengths_s, default=0.0),
                               "most_parts": self._most_parts, "episodes_s": episodes_s}}
