"""Relative poses that robots have found by their maps, against the truth."""

from __future__ import annotations

import math
from typing import NamedTuple

from desim.engine.trace import real
from desim.monitor.meters.meter import Meter
from desim.monitor.samples import Sample
from desim.monitor.truth import Truth
from desim.robot.mapping.robot_map import RobotMap
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


class RelativePoses(Meter):
    """The frames of teammates that robots have accepted, and their errors. An episode begins when a
    robot accepts a teammate's frame, and ends when it drops it."""

    def __init__(self, truth: Truth) -> None:
        self._truth, self._names = truth, truth.trace.names
        self._pairs = len(truth.explorers) * (len(truth.explorers) - 1)
        self._starts: dict[str, list[float]] = {}
        self._about: dict[str, str] = {}  # of whom each robot is speaking
        self._held: dict[tuple[str, str], Error] = {}
        self._false: set[tuple[str, str]] = set()  # of those held, the ones that were ever false
        self._first_ns: dict[tuple[str, str], int] = {}  # of right ones
        self._merges = self._false_merges = 0
        self.listeners = {"frame_of": self._speaks_of, "frame_at": self._placed,
                          "frame_lost": self._lost}

    def watch(self, robot: str, robot_map: RobotMap | None, now_ns: int) -> None:
        """A robot's frame is where it is when its software starts."""
        if robot_map is None:
            return
        self._starts[robot] = self._truth.poses()[self._truth.robots.index(robot)].tolist()
        for pair in [pair for pair in self._held if pair[0] == robot]:
            self._drop(pair)

    def _speaks_of(self, robot: str, source: int, *_: int) -> None:
        """Note that the next row of a robot is about the frame of ``source``, its number in the
        trace."""
        self._about[robot] = self._names[source]

    def _placed(self, robot: str, x: int, y: int, yaw: int) -> None:
        """Note where the robot takes that frame to be: the bits of x m, y m and yaw rad."""
        pair = robot, self._about[robot]
        x_m, y_m, yaw_rad = self._starts[pair[1]]
        error = Error(math.hypot(real(x) - x_m, real(y) - y_m),
                      abs(math.remainder(real(yaw) - yaw_rad, math.tau)))
        self._merges += pair not in self._held
        self._held[pair] = error
        if not error.is_false:
            self._first_ns.setdefault(pair, self._truth.kernel.now_ns)
        elif pair not in self._false:
            self._false.add(pair)
            self._false_merges += 1

    def _lost(self, robot: str, source: int, *_: int) -> None:
        """Note that a robot drops the frame of a teammate."""
        self._drop((robot, self._names[source]))

    def _drop(self, pair: tuple[str, str]) -> None:
        del self._held[pair]
        self._false.discard(pair)

    def summary(self, now_ns: int) -> Sample:
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
