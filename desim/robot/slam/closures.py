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
_DOUBTFUL_FIT = -1.5  # or half of them where others agree
# A place to which a long way leads is not known that well.
_DRIFT, _MOST_SIGMA_M = 0.01, 2.5  # m a metre; what is searched
_AGREED, _LATEST = 4, 10  # so many of the latest such closures must agree
_AGREE_M, _AGREE_RAD = 0.5, 0.05  # on the way between two of them


class ClosureFinder:
    """Finds the closures of a robot's nodes in ``fleet``."""

    def __init__(self, fleet: FleetGraph, settings: SlamSettings) -> None:
        self._fleet = fleet
        self._matcher = ParticleSlam(replace(settings, particles=1), 0, spread=0.0)
        self._doubtful: list[Closure] = []

    def found(self, name: str, own: int, ranges: np.ndarray) -> Iterator[Closure]:
        """The closures of node ``own`` of ``name``, whose scan has ``ranges`` [beams] m: with its
        own path, and with that of each teammate."""
        for source in self._fleet.tracks:
            if source == name:
                yield from self._of_own_path(name, own, ranges)
            elif own % _EVERY == 0:
                theirs = self._fleet.candidate(name, own, source, NEAR_M)
                closure = theirs is not None and self._closure(name, own, source, theirs, ranges,
                                                               _SIGMA_M)
                if closure:
                    yield closure

    def _of_own_path(self, name: str, own: int, ranges: np.ndarray) -> Iterator[Closure]:
        """The closures of a long loop are doubtful, as the place is searched widely, and corridors
        look alike. They are taken once several agree."""
        theirs = self._fleet.candidate(name, own, name, NEAR_M + _MOST_SIGMA_M)
        if theirs is None:
            return
        sigma_m = min(_DRIFT * self._fleet.way_m(name, own, name, theirs), _MOST_SIGMA_M)
        if sigma_m <= _SIGMA_M:
            theirs = self._fleet.candidate(name, own, name, NEAR_M)
        if theirs is None:
            return
        closure = self._closure(name, own, name, theirs, ranges, max(sigma_m, _SIGMA_M))
        if closure is None:
            return
        if sigma_m <= _SIGMA_M:
            yield closure
            return
        alike = [one for one in self._doubtful if self._agree(name, one, closure)]
        if len(alike) + 1 >= _AGREED:
            self._doubtful = []
            yield from (*alike, closure)
        else:
            self._doubtful = [*self._doubtful, closure][-_LATEST:]

    def _agree(self, name: str, one: Closure, other: Closure) -> bool:
        """Whether two closures say the same of the way between them (as in Mangelson et al. 2018,
        ICRA: pairwise consistency)."""
        path, theirs = self._fleet.path(name), self._fleet.path(other.source)
        by_own = compose(compose(one.motion, motion_between(path[one.own], path[other.own])),
                         motion_between(other.motion, np.zeros(3)))
        off = by_own - motion_between(theirs[one.theirs], theirs[other.theirs])
        return (math.hypot(off[0], off[1]) <= _AGREE_M
                and abs(float(wrapped(off[2]))) <= _AGREE_RAD)

    def _closure(self, name: str, own: int, source: str, theirs: int, ranges: np.ndarray,
                 sigma_m: float) -> Closure | None:
        """The closure with node ``theirs`` of ``source``, where ``sigma_m`` is the standard
        deviation of the place; None where the scan does not fit, or does not show its place."""
        self._matcher.start_map(*self._fleet.submap(source, theirs))
        expected = motion_between(self._fleet.path(source)[theirs], self._fleet.path(name)[own])
        motion, fit, information = self._matcher.match(
            expected, np.array((sigma_m, sigma_m, _SIGMA_RAD)), ranges)
        away_m = math.hypot(motion[0] - expected[0], motion[1] - expected[1])
        least = _FIT if sigma_m <= _SIGMA_M else _DOUBTFUL_FIT
        if fit < least or away_m > _WITHIN_SIGMAS * sigma_m or weakest(information)[0] < WEAK:
            return None
        return Closure(own, source, theirs, motion, information, max(sigma_m, DRIFT_M))
