"""Loop closures: scans that are matched with the submaps of older nodes, or of teammates."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from desim.robot.slam.fleet_graph import WEAK, Closure, FleetGraph, weakest
from desim.robot.slam.particle_filter import ParticleSlam
from desim.robot.slam.settings import SlamSettings
from desim.robot.transforms import motion_between

# All of these are ours.
_EVERY = 3  # every third node is matched with teammates' paths, all with the own one
_SIGMA_M, _SIGMA_RAD = 0.4, 0.04  # of where it is expected
_WITHIN_M = 1.5  # of that a closure is, at most
_FIT = -1.0  # of a closure, at least: a third of the returns may meet nothing


class ClosureFinder:
    """Finds the closures of a robot's nodes in ``fleet``."""

    def __init__(self, fleet: FleetGraph, settings: SlamSettings) -> None:
        self._fleet = fleet
        self._matcher = ParticleSlam(replace(settings, particles=1), 0, spread=0.0)

    def found(self, name: str, own: int, ranges: np.ndarray) -> Iterator[Closure]:
        """The closures of node ``own`` of ``name``, whose scan has ``ranges`` [beams] m: with its
        own path, and with that of each teammate."""
        pose = self._fleet.path(name)[own]
        for source in self._fleet.tracks:
            theirs = self._fleet.candidate(name, own, source)
            if theirs is None or own % _EVERY and source != name:
                continue
            self._matcher.start_map(*self._fleet.submap(source, theirs))
            expected = motion_between(self._fleet.path(source)[theirs], pose)
            motion, fit, information = self._matcher.match(
                expected, np.array((_SIGMA_M, _SIGMA_M, _SIGMA_RAD)), ranges)
            away_m = math.hypot(motion[0] - expected[0], motion[1] - expected[1])
            if fit >= _FIT and away_m <= _WITHIN_M and weakest(information)[0] >= WEAK:
                yield Closure(own, source, theirs, motion, information)
