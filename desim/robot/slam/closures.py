"""Loop closures: scans that are matched with the submaps of older nodes, or of teammates."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from desim.robot.slam.fleet_graph import DRIFT_M, NEAR_M, WEAK, Closure, FleetGraph, weakest
from desim.robot.slam.particle_filter import ParticleSlam
from desim.robot.slam.settings import SlamSettings
from desim.robot.transforms import compose, motion_between, wrapped

# All of these are ours.
_EVERY = 3  # every third node is matched with teammates' paths, all with the own one
_SIGMA_M, _SIGMA_RAD = 0.4, 0.04  # of where it is expected
_WITHIN_SIGMAS = 3.75  # of that a closure is, at most: 1.5 m
_FIT = -1.0  # of a closure, at least: a third of the returns may meet nothing,
DOUBTFUL_FIT = -1.5  # or half of them where others agree
# A place to which a long way leads is not known that well.
_DRIFT, _MOST_SIGMA_M = 0.01, 2.5  # m a metre; what is searched
_AGREED, _LATEST = 4, 10  # so many of the latest such closures must agree
_AGREE_M, _AGREE_RAD = 0.5, 0.05  # on the way between two of them


class DoubtfulClosures:
    """Closures of two paths that count once several agree, as corridors look alike."""

    def __init__(self) -> None:
        self._waiting: list[Closure] = []

    def agreed(self, closure: Closure, own: np.ndarray, theirs: np.ndarray) -> list[Closure]:
        """All that agree with ``closure``, and itself, if these are enough. ``own``, ``theirs``:
        the two paths, poses [n, 3] of nodes, each in a frame of its own or in the same one."""
        alike = [one for one in self._waiting if agree(one, closure, own, theirs)]
        if len(alike) + 1 >= _AGREED:
            self._waiting = []
            return [*alike, closure]
        self._waiting = [*self._waiting, closure][-_LATEST:]
        return []


class ScanMatcher:
    """Places scans on submaps."""

    def __init__(self, settings: SlamSettings) -> None:
        self._matcher = ParticleSlam(replace(settings, particles=1), 0, spread=0.0)

    def closure(self, fleet: FleetGraph, own: int, source: str, theirs: int, expected: np.ndarray,
                ranges: np.ndarray, sigma_m: float, least_fit: float) -> Closure | None:
        """The closure of a scan (ranges [beams] m) of node ``own`` with node ``theirs`` of
        ``source`` in ``fleet``, as seen from which it is ``expected`` [3], with the standard
        deviation ``sigma_m``; None where it does not fit, or does not show its place."""
        self._matcher.start_map(*fleet.submap(source, theirs))
        motion, fit, information = self._matcher.match(
            expected, np.array((sigma_m, sigma_m, _SIGMA_RAD)), ranges)
        away_m = math.hypot(motion[0] - expected[0], motion[1] - expected[1])
        if (fit < least_fit or away_m > _WITHIN_SIGMAS * sigma_m
                or weakest(information)[0] < WEAK):
            return None
        return Closure(own, source, theirs, motion, information, max(sigma_m, DRIFT_M))


class ClosureFinder:
    """Finds the closures of a robot's nodes in ``fleet``."""

    def __init__(self, fleet: FleetGraph, matcher: ScanMatcher) -> None:
        self._fleet, self._matcher = fleet, matcher
        self._doubtful = DoubtfulClosures()

    def found(self, name: str, own: int, ranges: np.ndarray) -> Iterator[Closure]:
        """The closures of node ``own`` of ``name``, whose scan has ``ranges`` [beams] m: with its
        own path, and with that of each teammate."""
        for source in self._fleet.tracks:
            if source == name:
                yield from self._of_own_path(name, own, ranges)
            elif own % _EVERY == 0:
                closure = self._closure(name, own, source, ranges, 0.0)
                if closure is not None:
                    yield closure

    def _of_own_path(self, name: str, own: int, ranges: np.ndarray) -> Iterator[Closure]:
        """The closures of a long loop are doubtful, as the place is searched widely."""
        theirs = self._fleet.candidate(name, own, name, NEAR_M + _MOST_SIGMA_M)
        if theirs is None:
            return
        sigma_m = min(_DRIFT * self._fleet.way_m(name, own, name, theirs), _MOST_SIGMA_M)
        closure = self._closure(name, own, name, ranges, sigma_m)
        if closure is None:
            return
        if sigma_m <= _SIGMA_M:
            yield closure
        else:
            path = self._fleet.path(name)
            yield from self._doubtful.agreed(closure, path, path)

    def _closure(self, name: str, own: int, source: str, ranges: np.ndarray, sigma_m: float
                 ) -> Closure | None:
        """The closure with the nearest node of ``source``, where ``sigma_m`` or a bit more is the
        standard deviation of the place."""
        known = sigma_m <= _SIGMA_M
        theirs = self._fleet.candidate(name, own, source,
                                       NEAR_M if known else NEAR_M + _MOST_SIGMA_M)
        if theirs is None:
            return None
        expected = motion_between(self._fleet.path(source)[theirs], self._fleet.path(name)[own])
        return self._matcher.closure(self._fleet, own, source, theirs, expected, ranges,
                                     max(sigma_m, _SIGMA_M), _FIT if known else DOUBTFUL_FIT)


def agree(one: Closure, other: Closure, own: np.ndarray, theirs: np.ndarray) -> bool:
    """Whether two closures of the same paths say the same of the way between them (as in Mangelson
    et al. 2018, ICRA: pairwise consistency). Arguments as those of ``agreed``."""
    by_own = compose(compose(one.motion, motion_between(own[one.own], own[other.own])),
                     motion_between(other.motion, np.zeros(3)))
    off = by_own - motion_between(theirs[one.theirs], theirs[other.theirs])
    return (math.hypot(off[0], off[1]) <= _AGREE_M
            and abs(float(wrapped(off[2]))) <= _AGREE_RAD)
