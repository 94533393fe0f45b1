"""The pose graph of a fleet, as one robot knows it: its own nodes and those it was told of."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from desim.robot.slam.pose_graph import PoseGraph
from desim.robot.slam.sightings import Sighting
from desim.robot.transforms import compose, motion_between, wrapped

# The least information on the place, by direction, is at least this share of the greatest where a
# scan shows it: in bare corridors returns without normals feign up to 0.01 (ours: of 281 closures
# in the loop none above 0.03 was false, and 71 of 126 below 0.01).
WEAK = 0.03
# All of these are ours. docs/slam.md has what comes of leaving parts out.
# Errors of ties that neither matching nor odometry account for (m, m, rad): of the map's cells.
_LOOSE_STEP = np.diag((0.004, 0.004, 0.0005)) ** 2
_LOOSE_CLOSURE = np.diag((0.03, 0.03, 0.002)) ** 2
NEAR_M, _ALIKE_RAD = 5.0, 1.0  # nodes whose scans may show the same walls
_APART = 40  # nodes of one path between two that may close a loop
_BESIDE = 6  # nodes on each side whose scans make a submap
DRIFT_M = 0.5  # of places before a tie holds them, at least
_GATE_M = 1.0  # between a sighting and the teammate that it is of, at most,
_CLEAR = 2.0  # and another teammate is so many times as far


class Closure(NamedTuple):
    """A scan of one's own node ``own`` was found to lie at ``motion`` [3] as seen from node
    ``theirs`` of ``source``, with this ``information`` [3, 3]. Without it that place was known to
    ``drift_m``, a standard deviation."""

    own: int
    source: str
    theirs: int
    motion: np.ndarray
    information: np.ndarray
    drift_m: float = DRIFT_M


class Seen(NamedTuple):
    """At node ``own`` a body was sighted."""

    own: int
    sighting: Sighting


class Encounter(NamedTuple):
    """The body of ``sighting``, seen from one's own node ``own``, is ``source``, which was at this
    ``share`` of its way from node ``theirs`` to the next."""

    own: int
    source: str
    theirs: int
    share: float
    sighting: Sighting


@dataclass
class NodePath:
    """The path of one robot: its nodes' numbers in the graph, their stamps, and their scans (ranges
    [beams] m; None where they were not sent)."""

    nodes: list[int] = field(default_factory=list)
    stamps_ns: list[int] = field(default_factory=list)
    scans: list[np.ndarray | None] = field(default_factory=list)


class FleetGraph:
    """Nodes and ties of several robots, by their names."""

    def __init__(self) -> None:
        self.graph = PoseGraph()
        self.tracks: dict[str, NodePath] = {}

    def add(self, name: str, stamp_ns: int, motion: np.ndarray, information: np.ndarray,
            scan: np.ndarray | None, anchored: bool = True) -> None:
        """Add a node of robot ``name``: ``motion`` [3] from its last one, with the
        ``information`` [3, 3] on it; of the first, its pose, which is held if ``anchored``."""
        track = self.tracks.setdefault(name, NodePath())
        if track.nodes:
            last = track.nodes[-1]
            node = self.graph.add_node(compose(self.graph.poses[last], motion))
            self.graph.tie(last, node, motion, loosened(information, _LOOSE_STEP))
        else:
            node = self.graph.add_node(motion)
            if anchored:
                self.graph.anchor(node)
        track.nodes.append(node)
        track.stamps_ns.append(stamp_ns)
        track.scans.append(scan)

    def close(self, name: str, closure: Closure) -> None:
        """Tie a node of ``name`` to another one whose walls its scan fits."""
        self.graph.tie(self.tracks[closure.source].nodes[closure.theirs],
                       self.tracks[name].nodes[closure.own], closure.motion,
                       loosened(closure.information, _LOOSE_CLOSURE), drift_m=closure.drift_m)

    def meet(self, name: str, meeting: Encounter) -> None:
        """Tie a node of ``name`` to that of a teammate that it has seen."""
        sighting, track = meeting.sighting, self.tracks[meeting.source]
        before, after = track.nodes[meeting.theirs:meeting.theirs + 2]
        self.graph.tie(self.tracks[name].nodes[meeting.own], before,
                       np.array((sighting.x_m, sighting.y_m, 0.0)), sighting.information, DRIFT_M,
                       (after, meeting.share))

    def path(self, name: str) -> np.ndarray:
        """[n, 3] the poses of the nodes of ``name``."""
        return self.graph.poses[self.tracks[name].nodes]

    def knows(self, name: str, node: int) -> bool:
        """Whether node ``node`` of ``name`` has come."""
        return name in self.tracks and node < len(self.tracks[name].nodes)

    def way_m(self, name: str, own: int, source: str, theirs: int) -> float:
        """The length of the shortest way by ties from node ``theirs`` of ``source`` to node ``own``
        of ``name``: errors of motions that lead elsewhere do not matter (Olson 2009, Robotics and
        Autonomous Systems 57: Dijkstra projection)."""
        return self.graph.way_m(self.tracks[source].nodes[theirs], self.tracks[name].nodes[own])

    def candidate(self, name: str, own: int, source: str, within_m: float) -> int | None:
        """The nearest node of ``source``, up to ``within_m`` away, that looks where node ``own`` of
        ``name`` does, and whose scan is known; a loop of one path needs some length."""
        track, pose = self.tracks[source], self.path(name)[own]
        poses = self.path(source)[:max(own - _APART, 0) if source == name else None]
        if not len(poses):
            return None
        away = np.hypot(poses[:, 0] - pose[0], poses[:, 1] - pose[1])
        away[np.abs(wrapped(poses[:, 2] - pose[2])) > _ALIKE_RAD] = math.inf
        best = int(away.argmin())
        return best if away[best] <= within_m and track.scans[best] is not None else None

    def submap(self, source: str, node: int) -> tuple[np.ndarray, list[np.ndarray]]:
        """The poses [n, 3] of nodes around ``node`` of ``source``, as seen from it, and their
        scans."""
        track = self.tracks[source]
        near = [k for k in range(max(node - _BESIDE, 0), min(node + _BESIDE + 1, len(track.nodes)))
                if track.scans[k] is not None]
        poses = self.path(source)
        return motion_between(poses[node][None], poses[near]), [
            scan for k in near if (scan := track.scans[k]) is not None]

    def met(self, name: str, seen: Seen, team: Iterable[str]) -> Encounter | None:
        """The teammate that was seen; None where no place fits, or two do."""
        track = self.tracks[name]
        stamp_ns = track.stamps_ns[seen.own]
        place = compose(self.path(name)[seen.own],
                        np.array((seen.sighting.x_m, seen.sighting.y_m, 0.0)))
        found: list[tuple[float, str, int, float]] = []
        for other in team:
            at = self._at(other, stamp_ns)
            there = self.place(other, stamp_ns)
            if at is not None and there is not None:
                found.append((math.dist(there, place[:2]), other, *at))
        found.sort()
        if not found or found[0][0] > _GATE_M or (
                len(found) > 1 and found[1][0] < _CLEAR * found[0][0]):
            return None
        _, source, node, share = found[0]
        return Encounter(seen.own, source, node, share, seen.sighting)

    def place(self, name: str, stamp_ns: int) -> tuple[float, float] | None:
        """The place of ``name`` at ``stamp_ns``: x m, y m; None where that is not known."""
        at = self._at(name, stamp_ns)
        if at is None:
            return None
        before, after = self.graph.poses[self.tracks[name].nodes[at[0]:at[0] + 2], :2]
        x_m, y_m = before + at[1] * (after - before)
        return float(x_m), float(y_m)

    def _at(self, name: str, stamp_ns: int) -> tuple[int, float] | None:
        """The last node of ``name`` until ``stamp_ns``, and the share of the time from there to the
        next node. None where that node is not known."""
        track = self.tracks.get(name)
        k = 0 if track is None else bisect_right(track.stamps_ns, stamp_ns)
        if track is None or not 0 < k < len(track.nodes):
            return None
        before, after = track.stamps_ns[k - 1:k + 1]
        return k - 1, (stamp_ns - before) / (after - before)


def weakest(information: np.ndarray) -> tuple[float, np.ndarray]:
    """The least information on the place as a share of the greatest, and its direction [2]."""
    values, axes = np.linalg.eigh(information[:2, :2])
    return float(values[0] / max(values[1], 1e-12)), axes[:, 0]


def shown(information: np.ndarray) -> np.ndarray:
    """The ``information`` [3, 3] of a scan on its pose, without any along a bare corridor."""
    share, axis = weakest(information)
    if share >= WEAK:
        return information
    across = np.eye(3)
    across[:2, :2] -= np.outer(axis, axis)
    return across @ information @ across


def on_motion(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The information [3, 3] on the motion between two poses, where that on their places on one map
    is ``one`` and ``other``: covariances add up. So a scan that shows where the robot is says
    little of the step that led there from a place that was not known."""
    return loosened(one, np.linalg.inv(other + 1e-6 * np.eye(3)))


def loosened(information: np.ndarray, more: np.ndarray) -> np.ndarray:
    """The ``information`` [3, 3], of what has the covariance ``more`` [3, 3] besides."""
    matrix = information @ np.linalg.inv(np.eye(3) + more @ information)
    return 0.5 * (matrix + matrix.T)
