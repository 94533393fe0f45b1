"""Teammates of whom a robot does not know where they are, and how it finds out.

The bodies that a robot has seen and the paths that strangers report are compared: two bodies lie as
far apart as a stranger drove in the time between, if it was that stranger both times. Where they
do, its path is laid through both, and scans decide: several must fit the stranger's submaps, and
agree on the way between them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import islice
from typing import NamedTuple

import numpy as np

from desim.robot.slam.closures import DOUBTFUL_FIT, DoubtfulClosures, ScanMatcher
from desim.robot.slam.fleet_graph import NEAR_M, Closure, FleetGraph
from desim.robot.slam.sightings import Sighting
from desim.robot.transforms import compose, motion_between

# All of these are ours.
_LEAST_M, _UNLIKE_M = 2.0, 0.15  # between two sightings: at least; and what the stranger says of it
_SEEN, _TRIED = 20, 3  # the latest sightings that are compared; the paths that are tried a scan
_EXPLAINED = 3  # sightings that a path must explain, at least
_FRIEND_M = 1.0  # a body that is so near to where somebody known was is no stranger
_SIGMA_M = 0.4  # of a path that is laid through two sightings


class _Body(NamedTuple):
    """A body that was seen at ``stamp_ns``, at ``x_m``, ``y_m`` in the robot's own coordinates."""

    stamp_ns: int
    x_m: float
    y_m: float


_Seen = tuple[_Body, tuple[float, float]]


class Strangers:
    """The strangers of a robot. ``fleet`` has their paths, each from a first node at 0, 0, 0."""

    def __init__(self, matcher: ScanMatcher) -> None:
        self.fleet = FleetGraph()
        self._matcher = matcher
        self._bodies: list[_Body] = []
        self._doubtful: dict[str, DoubtfulClosures] = {}

    def saw(self, stamp_ns: int, pose: np.ndarray, seen: list[Sighting]) -> None:
        """Note what was seen from the own ``pose`` [3]."""
        places = (compose(pose, np.array((one.x_m, one.y_m, 0.0))) for one in seen)
        self._bodies += [_Body(stamp_ns, float(place[0]), float(place[1])) for place in places]
        self._bodies = self._bodies[-_SEEN:]

    def found(self, fleet: FleetGraph, name: str, ranges: np.ndarray) -> Iterator[list[Closure]]:
        """For each stranger that is one no more, the closures that agree on where it is. ``fleet``
        has the paths of those that are known and the own one, of ``name``, ``ranges`` [beams] m is
        the scan of its last node."""
        self._bodies = [body for body in self._bodies if not _is_known(fleet, name, body)]
        path = fleet.path(name)
        found = [one for source in self.fleet.tracks
                 if (one := self._closure(source, path, ranges)) is not None]
        for closure, bodies in found:
            source = closure.source
            if source not in self.fleet.tracks or any(
                    bodies & others for other, others in found if other is not closure):
                continue  # another one has introduced it, or one body would be two strangers
            doubtful = self._doubtful.setdefault(source, DoubtfulClosures())
            agreed = doubtful.agreed(closure, path, self.fleet.path(source))
            if agreed:
                yield agreed

    def _closure(self, source: str, path: np.ndarray, ranges: np.ndarray
                 ) -> tuple[Closure, set[_Body]] | None:
        """A closure of the last scan with the path of ``source`` that is laid through sightings,
        and the bodies that it explains."""
        theirs, tracks = self.fleet.path(source), self.fleet.tracks[source]
        places = [(body, self.fleet.place(source, body.stamp_ns))
                  for body in reversed(self._bodies)]
        known = [(body, place) for body, place in places if place is not None]
        for frame in islice(_frames(known), _TRIED):
            placed = compose(frame, theirs)
            away = np.hypot(*(placed[:, :2] - path[-1, :2]).T)
            node = int(away.argmin())
            if away[node] > NEAR_M or tracks.scans[node] is None:
                continue
            closure = self._matcher.closure(
                self.fleet, len(path) - 1, source, node, motion_between(placed[node], path[-1]),
                ranges, _SIGMA_M, DOUBTFUL_FIT)
            if closure is not None:
                moved = compose(path[-1], _inverse(closure.motion))
                by_scan = compose(moved, _inverse(theirs[node]))
                bodies = _explained(by_scan, known)
                if len(bodies) >= _EXPLAINED:
                    return closure, bodies
        return None

    def introduced(self, fleet: FleetGraph, name: str, tie: Closure
                   ) -> Iterator[tuple[str, np.ndarray]]:
        """The stranger, and the pose [3] of its first node, of a closure of ``name`` that ties it
        to somebody in ``fleet``. It is one no more."""
        strange, source = self.fleet, tie.source
        if fleet.knows(name, tie.own) and strange.knows(source, tie.theirs):
            node, theirs = compose(fleet.path(name)[tie.own], _inverse(tie.motion)), tie.theirs
        elif fleet.knows(source, tie.theirs) and strange.knows(name, tie.own):
            node, theirs = compose(fleet.path(source)[tie.theirs], tie.motion), tie.own
            source = name
        else:
            return
        frame = compose(node, _inverse(strange.path(source)[theirs]))
        del strange.tracks[source]
        yield source, frame


def _frames(known: list[_Seen]) -> Iterator[np.ndarray]:
    """The frames [3] that lay the path of a stranger through two bodies, the newest first, and
    explain enough of them. ``known``: bodies, and where it was then by its own path."""
    for k, (last, there) in enumerate(known):
        for first, here in known[k + 1:]:
            seen_m = math.hypot(last.x_m - first.x_m, last.y_m - first.y_m)
            if seen_m >= _LEAST_M and abs(seen_m - math.dist(there, here)) <= _UNLIKE_M:
                turn_rad = (math.atan2(last.y_m - first.y_m, last.x_m - first.x_m)
                            - math.atan2(there[1] - here[1], there[0] - here[0]))
                turned = compose(np.array((0.0, 0.0, turn_rad)), np.array((*there, 0.0)))
                frame = np.array((last.x_m - turned[0], last.y_m - turned[1], turn_rad))
                if len(_explained(frame, known)) >= _EXPLAINED:
                    yield frame


def _is_known(fleet: FleetGraph, name: str, body: _Body) -> bool:
    """Whether somebody else in ``fleet`` than ``name`` was where the body was seen."""
    places = (fleet.place(other, body.stamp_ns) for other in fleet.tracks if other != name)
    return any(place is not None and math.dist(place, body[1:]) <= _FRIEND_M for place in places)


def _explained(frame: np.ndarray, known: list[_Seen]) -> set[_Body]:
    """The bodies that were seen where the path of a stranger with this ``frame`` leads,
    which was then at the place beside."""
    places = compose(frame, np.array([(*place, 0.0) for _, place in known]))
    return {body for (body, _), place in zip(known, places, strict=True)
            if math.hypot(body.x_m - place[0], body.y_m - place[1]) <= 2.0 * _UNLIKE_M}


def _inverse(motion: np.ndarray) -> np.ndarray:
    """The pose [3] from which ``motion`` [3] leads to the origin."""
    return motion_between(motion, np.zeros(3))
