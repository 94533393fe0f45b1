"""Relative poses that robots have found by their maps, against the truth."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from desim.engine.trace import Names, real
from desim.units import NS_PER_S

# A merge is false if it was ever farther off than this (ours): a quarter of the width of a road in
# the paper's terrains, or the turn that makes as much 40 m away.
FALSE_M, FALSE_RAD = 2.0, 0.05


class Error(NamedTuple):
    """The error of a relative pose."""

    off_m: float
    off_rad: float

    @property
    def is_false(self) -> bool:
        """Whether the error is so large that the maps do not belong together like this."""
        return self.off_m > FALSE_M or self.off_rad > FALSE_RAD


class RelativePoses:
    """The frames of teammates that robots have accepted, and their errors. ``true_poses()``
    [robots, 3] and ``now_ns()`` are those of now. An episode begins when a robot accepts a
    teammate's frame, and ends when it drops it."""

    def __init__(self, robots: tuple[str, ...], explorers: tuple[str, ...], names: Names,
                 true_poses: Callable[[], np.ndarray], now_ns: Callable[[], int]) -> None:
        self._robots, self._names = robots, names
        self._pairs = len(explorers) * (len(explorers) - 1)
        self._true_poses, self._now_ns = true_poses, now_ns
        self._starts: dict[str, list[float]] = {}
        self._about: dict[str, str] = {}  # of whom each robot is speaking
        self._held: dict[tuple[str, str], Error] = {}
        self._false: set[tuple[str, str]] = set()  # of those held, the ones that were ever false
        self._first_ns: dict[tuple[str, str], int] = {}  # of right ones
        self._merges = self._false_merges = 0

    def started(self, robot: str) -> None:
        """Note that the software of a robot starts: its frame is where it is now."""
        self._starts[robot] = self._true_poses()[self._robots.index(robot)].tolist()
        for pair in [pair for pair in self._held if pair[0] == robot]:
            self._drop(pair)

    def about(self, robot: str, source: int, *_: int) -> None:
        """Note that the next row of a robot is about the frame of ``source``, its number in the
        trace."""
        self._about[robot] = self._names[source]

    def placed(self, robot: str, x: int, y: int, yaw: int) -> None:
        """Note where the robot takes that frame to be: the bits of x m, y m and yaw rad."""
        pair = robot, self._about[robot]
        x_m, y_m, yaw_rad = self._starts[pair[1]]
        error = Error(math.hypot(real(x) - x_m, real(y) - y_m),
                      abs(math.remainder(real(yaw) - yaw_rad, math.tau)))
        self._merges += pair not in self._held
        self._held[pair] = error
        if not error.is_false:
            self._first_ns.setdefault(pair, self._now_ns())
        elif pair not in self._false:
            self._false.add(pair)
            self._false_merges += 1

    def lost(self, robot: str, source: int, *_: int) -> None:
        """Note that a robot drops the frame of a teammate."""
        self._drop((robot, self._names[source]))

    def _drop(self, pair: tuple[str, str]) -> None:
        del self._held[pair]
        self._false.discard(pair)

    def summary(self) -> dict[str, float | None]:
        """``merges`` and ``false_merges``; ``merged_pairs``: the share of all ordered pairs that
        hold a correct frame at the end; ``merge_error_m`` and ``merge_error_rad``: the root mean
        square errors of these; ``merge_time_s``: the time of a pair's first correct merge, as a
        mean over the pairs that had one. None where no robot has merged."""
        right = [error for error in self._held.values() if not error.is_false]
        times = list(self._first_ns.values())
        return {"merges": self._merges, "false_merges": self._false_merges,
                "merged_pairs": len(right) / self._pairs if self._merges else None,
                "merge_error_m": _root([error.off_m for error in right]),
                "merge_error_rad": _root([error.off_rad for error in right]),
                "merge_time_s": sum(times) / len(times) / NS_PER_S if times else None}


def _root(errors: list[float]) -> float | None:
    """The root of the mean square; None if there is nothing."""
    return math.sqrt(math.fsum(e * e for e in errors) / len(errors)) if errors else None
