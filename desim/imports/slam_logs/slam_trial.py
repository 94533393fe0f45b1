"""SLAM on a log: real odometry and scans, no simulator."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from desim.imports.slam_logs.laser_log import LaserLog
from desim.robot.slam.particle_filter import GridMap, ParticleSlam
from desim.robot.transforms import compose, motion_between, wrapped

# The pose [3] of a scan (ranges [beams]) from the expected one and the motion since a node.
Locate = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]

_METRES_PER_RAD = 0.5  # a turn counts as this distance where a correction is spread over motion


class SlamTrial(NamedTuple):
    """The outcome of SLAM on a log.

    ``online`` [scans, 3]: the pose at each scan as it was known then | ``path`` [scans, 3]: that of
    the best particle at the end | ``processed`` [scans] bool | ``resampled``: how often particles
    were resampled | ``cpu_s`` [processed]: CPU time of each update that processed a scan.
    ``resampled`` and ``particles`` are None for a plug-in, of which nothing is known.
    """

    online: np.ndarray
    path: np.ndarray
    processed: np.ndarray
    resampled: int | None
    cpu_s: np.ndarray
    particles: int | None
    map: GridMap


def play(slam: ParticleSlam, log: LaserLog, clock: Callable[[], float],
         done: Callable[[int, int], object] = lambda part, whole: None) -> SlamTrial:
    """Feed a log to a SLAM that is new. ``clock``: CPU time in s | ``done(part, whole)``: called
    now and then."""
    scans = len(log.times_s)
    online, processed, cpu_s = np.zeros((scans, 3)), np.zeros(scans, bool), []
    for k in range(scans):
        begin_s = clock()
        processed[k] = slam.update(log.odometry[k], log.ranges[k])
        if processed[k]:
            cpu_s.append(clock() - begin_s)
        online[k] = slam.pose
        done(k + 1, 2 * scans)
    resampled = sum(bool((step.ancestors != np.arange(len(step.ancestors))).any())
                    for step in slam.history)
    path = whole_path(slam.path(), log, processed, slam.locate,
                      lambda k: done(scans + k, 2 * scans))
    return SlamTrial(online, path, processed, resampled, np.array(cpu_s), slam.particles,
                     slam.map())


def whole_path(nodes: np.ndarray, log: LaserLog, processed: np.ndarray, locate: Locate,
               done: Callable[[int], object] = lambda scan: None) -> np.ndarray:
    """The path at all scans: ``nodes`` [processed, 3] at processed ones. ``locate`` places each
    scan in between, beginning where the odometry puts it between its two neighbours."""
    at = np.flatnonzero(processed)
    steps = motion_between(log.odometry[:-1], log.odometry[1:])
    way = np.r_[0.0, np.cumsum(np.hypot(steps[:, 0], steps[:, 1])
                               + _METRES_PER_RAD * np.abs(wrapped(steps[:, 2])))]
    path = np.zeros((len(processed), 3))
    path[:at[0]] = compose(nodes[0], motion_between(log.odometry[at[0]], log.odometry[:at[0]]))
    for node, first in enumerate(at):
        last = at[node + 1] if node + 1 < len(at) else len(processed)
        path[first] = nodes[node]
        for k in range(first + 1, last):
            motion = motion_between(log.odometry[first], log.odometry[k])
            expected = compose(nodes[node], motion)
            if last < len(processed):
                all_of = motion_between(log.odometry[first], log.odometry[last])
                missing = motion_between(compose(nodes[node], all_of), nodes[node + 1])
                part = (way[k] - way[first]) / max(way[last] - way[first], 1e-9)
                expected = compose(expected, missing * part)
            path[k] = locate(expected, motion, log.ranges[k])
            done(k)
    return path
