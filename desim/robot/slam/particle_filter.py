"""SLAM by particles that each have a pose and a map of their own.

The Rao-Blackwellized particle filter of Grisetti, Stachniss and Burgard, "Improved techniques for
grid mapping with Rao-Blackwellized particle filters", IEEE Transactions on Robotics 23 (2007).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from desim.ports import Pose2D
from desim.robot.slam.kernels.alignment import Fit, align
from desim.robot.slam.kernels.particles import MotionPrior, ancestors, normalize, propose
from desim.robot.slam.kernels.points import Beams, points_of, thinned, without_bodies
from desim.robot.slam.kernels.search import search
from desim.robot.slam.particle_number import wanted_particles
from desim.robot.slam.settings import SlamSettings
from desim.robot.slam.shared_maps import SharedMaps
from desim.robot.transforms import compose, motion_between, motion_to, turned

# Constants without a source are ours. docs/slam.md has what another value of one makes of a real
# log's error.

# Standard deviations of a return's residual: the sensor's noise in m, and the blur of cells, in
# cells. The rough alignment has a larger one: with the smaller one the likelihood has no gradient
# at a pose that is a cell off.
_SIGMA_M = 0.01
_SIGMA_CELLS = 0.05
_ROUGH_CELLS = 0.25
_OUTLIER_SIGMAS = 2.5  # the scale at which residuals begin to be outliers
_REACH_CELLS = 1.5  # from a return to the cells whose surface it may belong to
_STEPS = 10  # of Gauss-Newton, at most
# Returns of a scan that count as independent. It has more, but the errors of neighbours are alike.
_EFFECTIVE = 60.0
_SPACING_CELLS = 1.0  # between the returns that are aligned

# The window of the search.
_COARSE_M = 0.1  # its step, if a cell is not larger
_WINDOW_SIGMAS = 2.5  # its half width in standard deviations of the odometry,
_WINDOW_M = 0.5, 1.0  # and the bounds of it for the position
_WINDOW_RAD = 0.3, 0.8  # and for the heading
_STRAYED_SIGMAS = 1.5  # odometry that the search finds farther off counts as that far off

# The exponent of weights before resampling (gmapping's: 1 / 90, with ``ogain`` 3 and 30 particles).
# Errors of successive scans are alike, and particles that are resampled at every fifth scan have
# one common ancestor by the time a loop closes. docs/slam.md has the errors with other exponents.
_WEIGHT_EXPONENT = 0.05
# Another particle becomes the best when its path is this much more probable. In bare corridors all
# paths are about equally probable, and which one is the most is a matter of chance.
_DECISIVE = math.log(1e4)
_ANYWHERE = np.array((1e3, 1e3, 1e3))  # standard deviations of a pose of which nothing is known
_DRAWS = 2 ** 32  # counters of a step: more particles do not change the numbers of the others


class Processed(NamedTuple):
    """A processed scan: its odometry [3], and the ``poses`` [particles, 3] and ``ancestors``
    [particles] of the particles after it."""

    odometry: np.ndarray
    poses: np.ndarray
    ancestors: np.ndarray


@dataclass
class GridMap:
    """A robot's map: ``occupancy`` [rows, columns] of int8 as in ROS (0 free to 100 occupied, -1
    unknown), the place of the corner of its first cell, and its resolution."""

    occupancy: np.ndarray
    origin_m: tuple[float, float]
    resolution_m: float


class ParticleSlam:
    """A particle filter over poses and maps: ``update`` takes odometry and scans in; ``pose``,
    ``path`` and ``map`` are those of the best particle.

    ``key``: that of its random numbers (``Streams.key``) | ``spread``: the share of the standard
    deviations with which poses are drawn around the most likely one; 0 for one hypothesis.
    """

    def __init__(self, settings: SlamSettings, key: int, spread: float) -> None:
        self._settings, self._key, self._spread = settings, np.uint64(key), spread
        count, cell_m = settings.fewest, settings.resolution_m
        laser = settings.laser
        self._beams = Beams(laser.angle_min_rad, laser.increment_rad, laser.shortest_m,
                            laser.longest_m, *laser.mount)
        self._fit, self._rough = (
            Fit(sigma_m, _OUTLIER_SIGMAS * sigma_m, _REACH_CELLS * cell_m, _EFFECTIVE, _STEPS)
            for sigma_m in (_SIGMA_M + _SIGMA_CELLS * cell_m, _SIGMA_M + _ROUGH_CELLS * cell_m))
        self._coarse = max(1, round(_COARSE_M / cell_m))
        self.maps = SharedMaps(count, cell_m)
        self.poses = np.zeros((count, 3))
        self.weights, self._shares = np.zeros(count), np.full(count, 1.0 / count)
        self.path_weights = np.zeros(count)  # log-weights, as gmapping's ``weightSum``
        self.best = 0  # the particle whose pose the robot uses: not drawn, never dropped
        self._roots, self._lineage = np.zeros((count, 6)), np.arange(count)
        self.history: list[Processed] = []
        self._before: Pose2D | None = None  # the odometry of the scan before
        self._metres = self._radians = 0.0
        self._readings = 0
        self._odometry_sigmas = np.full(3, np.inf)  # of the last processed scan, and its heading
        self._heading_rad = 0.0

    @property
    def particles(self) -> int:
        """Their number, at most."""
        return self._settings.particles

    def update(self, odometry: np.ndarray, ranges: np.ndarray) -> bool:
        """Take in a scan (ranges [beams] in m) and the odometry [3] of its instant: x m, y m, yaw
        rad in any frame. Returns whether the scan was processed: the first is, and each one after
        enough motion.
        """
        is_due = self.advance(Pose2D(*odometry.tolist()))
        if is_due:
            self.process(ranges)
        return is_due

    def advance(self, odometry: Pose2D, readings: int = 1) -> bool:
        """Take in the odometry of a scan's instant, the last of ``readings`` since the scan before.
        Returns whether the scan is to be processed."""
        self._readings += readings
        if self._before is not None:
            motion = motion_to(self._before, odometry)
            self._metres += math.hypot(motion.x_m, motion.y_m)
            self._radians += abs(motion.yaw_rad)
        self._before = odometry
        settings = self._settings
        return not self.history or (self._metres >= settings.linear_update_m
                                    or self._radians >= settings.angular_update_rad)

    def process(self, ranges: np.ndarray) -> None:
        """Take in the scan (ranges [beams] in m) of the last ``advance``."""
        assert self._before is not None
        odometry, settings = np.array(self._before), self._settings
        points, fewer, count, kept = self._points(ranges)
        if self.history:
            self._move(odometry, fewer, kept)
        self.maps.add(self.poses, settings.laser.mount[:2], points[:count], fewer[:kept])
        self.history.append(Processed(odometry, self.poses.copy(), self._lineage))
        self._metres = self._radians = 0.0
        self._readings = 0

    def draw(self, pose: np.ndarray, ranges: np.ndarray) -> None:
        """Enter a scan (ranges [beams] in m) in the maps from a pose [3] that is known already."""
        points, fewer, count, kept = self._points(ranges)
        self.poses[:] = pose
        self.maps.add(self.poses, self._settings.laser.mount[:2], points[:count], fewer[:kept])

    def _move(self, odometry: np.ndarray, fewer: np.ndarray, kept: int) -> None:
        """Move the particles to where the scan fits, weigh them, and resample them if few of them
        are effective."""
        settings, motion = self._settings, motion_between(self.history[-1].odometry, odometry)
        sigmas = settings.noise.sigmas(motion, self._readings)
        expected = compose(self.poses, motion)
        start = self._search(expected[self.best], sigmas, fewer, kept)
        correction = motion_between(expected[self.best], start)
        wide = np.maximum(sigmas, np.abs(correction) / _STRAYED_SIGMAS)
        start = self._roughly(start, expected[self.best], wide, fewer, kept)
        correction = motion_between(expected[self.best], start)
        poses, gained = compose(expected, correction), np.empty(len(expected))
        self._roots = np.zeros((len(expected), 6))
        self._odometry_sigmas, self._heading_rad = wide, float(expected[self.best, 2])
        far = math.hypot(correction[0], correction[1]) > self._fit.reach_m
        prior = MotionPrior(sigmas, wide, settings.noise.strayed, far)
        step = len(self.history)
        propose(poses, expected, prior, fewer, kept, self.maps.arrays, self._fit, self._rough,
                self._spread, self.best, self._key, np.uint64(step * _DRAWS), gained, self._roots)
        self.poses = poses
        self._lineage = np.arange(len(poses))
        self.weights += gained
        self.path_weights += gained
        likeliest = int(np.argmax(self.path_weights))
        if self.path_weights[likeliest] > self.path_weights[self.best] + _DECISIVE:
            self.best = likeliest
        effective = normalize(self.weights * _WEIGHT_EXPONENT, self._shares)
        wanted = wanted_particles(poses, self.best, settings.fewest, settings.particles)
        if wanted != len(poses) or effective < settings.resample_threshold * len(poses):
            self._resample(step, wanted)

    def locate(self, expected: np.ndarray, motion: np.ndarray, ranges: np.ndarray) -> np.ndarray:
        """The most likely pose [3] of a scan on the map of the best particle, which stays as it is.

        ``expected``: the pose by odometry | ``motion`` [3]: the motion that led there, of which its
        uncertainty depends.
        """
        _, fewer, _, kept = self._points(ranges)
        sigmas = self._settings.noise.sigmas(motion, 1)
        pose = self._search(expected, sigmas, fewer, kept)
        sigmas = np.maximum(sigmas, np.abs(motion_between(expected, pose)) / _STRAYED_SIGMAS)
        align(self.best, pose, expected, sigmas, fewer, kept, self.maps.arrays, self._fit,
              np.empty(6))
        return pose

    def match(self, expected: np.ndarray, sigmas: np.ndarray, ranges: np.ndarray
              ) -> tuple[np.ndarray, float, np.ndarray]:
        """The best place of a scan (ranges [beams] m) on the best particle's map, which stays as it
        is: its pose [3], the fit, -3 (no return meets a surface) to 0 (all of them do), and
        the scan's information [3, 3] on that pose.

        ``expected`` [3]: where it is looked for, ``sigmas`` [3]: the standard deviations of that,
        along the robot, across it (m) and of its heading (rad); all poses within 2.5 are tried.
        """
        _, fewer, _, kept = self._points(ranges)
        pose, root = np.empty(3), np.zeros(6)
        window = _WINDOW_SIGMAS * np.array((max(sigmas[0], sigmas[1]), sigmas[2]))
        search(self.best, expected, sigmas, window, self._coarse, fewer, kept,
               self.maps.arrays, self._fit, self._settings.noise.strayed, pose)
        for fit in (self._rough, self._fit):
            scan, _ = align(self.best, pose, expected, _ANYWHERE, fewer, kept, self.maps.arrays,
                            fit, root)
        return pose, scan / _EFFECTIVE, _squared(root)

    @property
    def odometry_information(self) -> np.ndarray:
        """[3, 3] of the odometry on the pose of the last processed scan, in the map's directions;
        zeros before the second."""
        return turned(np.diag(self._odometry_sigmas ** -2), self._heading_rad)

    @property
    def scan_information(self) -> np.ndarray:
        """[3, 3] of the last processed scan on where its pose is on the best particle's map, as
        before."""
        return _squared(self._roots[self.best]) - self.odometry_information

    def start_map(self, poses: np.ndarray, scans: Sequence[np.ndarray]) -> None:
        """Forget the maps, and draw these scans (ranges [beams] m each) from their ``poses``
        [n, 3] instead; the particles stay where they are."""
        now, self.maps = self.poses.copy(), SharedMaps(len(self.poses), self._settings.resolution_m)
        for pose, ranges in zip(poses, scans, strict=True):
            self.draw(pose, ranges)
        self.poses[:] = now

    def _points(self, ranges: np.ndarray) -> tuple[np.ndarray, np.ndarray, int, int]:
        """The returns of a scan as points with normals, the thinned ones, and the number of each
        (in the order: all, thinned, number of all, number of thinned)."""
        widest_m, ranges = self._settings.bodies_m, np.ascontiguousarray(ranges, float)
        if widest_m:
            beyond = np.empty(len(ranges))
            without_bodies(ranges, self._beams, widest_m, beyond)
            ranges = beyond
        points, fewer = np.empty((len(ranges), 4)), np.empty((len(ranges), 4))
        count = points_of(ranges, self._beams, points, np.empty(len(ranges)))
        spacing_m = _SPACING_CELLS * self._settings.resolution_m
        return points, fewer, count, thinned(points, count, self._beams, spacing_m, fewer)

    def _roughly(self, found: np.ndarray, expected: np.ndarray, sigmas: np.ndarray,
                 points: np.ndarray, count: int) -> np.ndarray:
        """The pose of a rough alignment with the best particle's map: the likelier of two, one from
        the pose ``found`` by the search, one from the odometry's."""
        ends = found.copy(), expected.copy()
        there, here = (sum(align(self.best, pose, expected, sigmas, points, count,
                                 self.maps.arrays, self._rough, self._roots[0])) for pose in ends)
        return ends[here > there]

    def _search(self, expected: np.ndarray, sigmas: np.ndarray, points: np.ndarray,
                count: int) -> np.ndarray:
        """The best pose around the expected one, on the map of the best particle."""
        place_m, _, heading_rad = (_WINDOW_SIGMAS * sigmas).tolist()
        window = np.array((_within(place_m, *_WINDOW_M), _within(heading_rad, *_WINDOW_RAD)))
        best = np.empty(3)
        search(self.best, expected, sigmas, window, self._coarse, points, count,
               self.maps.arrays, self._fit, self._settings.noise.strayed, best)
        return best

    def _resample(self, step: int, wanted: int) -> None:
        """Draw new particles from the present ones, in proportion to their weights. The best one
        always survives."""
        chosen = np.empty(wanted, np.int64)
        # The normal numbers take the counters 2 k and 2 k + 1 of uniform ones, from 0 up.
        ancestors(self._shares, ~self._key, np.uint64(step), np.empty(len(self.poses), np.int64),
                  chosen)
        place = min(self.best, wanted - 1)
        chosen[place], self.best = self.best, place
        self.maps.follow(chosen)
        self.poses, self._lineage = self.poses[chosen], chosen
        self.path_weights = self.path_weights[chosen]
        self.weights, self._shares = np.zeros(wanted), np.full(wanted, 1.0 / wanted)

    @property
    def pose(self) -> np.ndarray:
        """The pose [3] now: that of the best particle, moved on by the odometry since its scan."""
        last = self.history[-1]
        assert self._before is not None
        return compose(self.poses[self.best],
                       motion_between(last.odometry, np.array(self._before)))

    def path(self) -> np.ndarray:
        """The poses [processed, 3] of the best particle and its ancestors."""
        at, poses = self.best, []
        for step in reversed(self.history):
            # A step's poses are those after its resampling.
            poses.append(step.poses[at])
            at = int(step.ancestors[at])
        return np.array(poses[::-1])

    def map(self) -> GridMap:
        """The map of the best particle. A cell is occupied at 100 * returns / visits."""
        visits, hits, origin_m = self.maps.counts(self.best)
        occupancy = np.full(visits.shape, -1, np.int8)
        for row, seen, returned in zip(occupancy, visits, hits, strict=True):  # of large maps
            at = np.flatnonzero(seen)
            row[at] = np.rint(100.0 * returned[at] / seen[at])
        return GridMap(occupancy, origin_m, self._settings.resolution_m)


def _squared(root: np.ndarray) -> np.ndarray:
    """[3, 3] the matrix of Cholesky's factor [6], the rows of its lower triangle."""
    lower = np.zeros((3, 3))
    lower[np.tril_indices(3)] = root
    return lower @ lower.T


def _within(value: float, least: float, most: float) -> float:
    return min(max(value, least), most)
