"""Settings of SLAM, with the source of each default."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from desim.ports.localization import LaserGeometry

SICK_LMS291 = LaserGeometry(-0.5 * math.pi, math.radians(0.5), longest_m=80.0)  # 361 beams


@dataclass(frozen=True)
class OdometryNoise:
    """The noise of the odometry between two processed scans, as standard deviations.

    They begin at ``least_m`` and ``least_rad``. They grow with the motion, as gmapping's do
    (``srr``, ``str``, ``srt``, ``stt``: 0.1, 0.1, 0.2, 0.2; here 0.1 rad/m), or with the square
    root of the number of readings, by ``reading_m`` and ``reading_rad``. The log-likelihood of the
    odometry counts as ``-strayed`` at least, since odometry may fail; if ``strayed`` is infinite,
    it never fails. ``spread`` is the share of the standard deviations with which particles are
    drawn. It is below 1 because each draw makes a particle's map fit worse: the best particle,
    which takes most likely poses, would win against particles that close a loop correctly.
    """

    m_per_m: float = 0.1
    m_per_rad: float = 0.1
    rad_per_m: float = 0.1
    rad_per_rad: float = 0.2
    least_m: float = 0.02
    least_rad: float = 0.01
    reading_m: float = 0.0
    reading_rad: float = 0.0
    strayed: float = 6.0
    spread: float = 0.5

    def sigmas(self, motion: np.ndarray, readings: int) -> np.ndarray:
        """Standard deviations [3] of a ``motion`` [3] over so many readings: along the robot and
        across it in m, of its heading in rad."""
        metres, radians = math.hypot(motion[0], motion[1]), abs(float(motion[2]))
        root = math.sqrt(readings)
        place_m = (self.least_m + self.m_per_m * metres + self.m_per_rad * radians
                   + self.reading_m * root)
        # The mean of a random walk has 1 / 3 of the variance of its end.
        aside_m = math.hypot(place_m, self.reading_rad * root * metres / math.sqrt(3.0))
        return np.array((place_m, aside_m, self.least_rad + self.rad_per_m * metres
                         + self.rad_per_rad * radians + self.reading_rad * root))


@dataclass(frozen=True)
class SlamSettings:
    """The settings of a particle filter for SLAM.

    There are ``particles`` at most, and ``least_particles`` where they agree on the pose; without
    bounds apart, always ``particles``, as in gmapping.
    A scan is processed after ``linear_update_m`` or ``angular_update_rad`` of motion. Particles are
    resampled when the effective sample size falls below ``resample_threshold`` of their number (the
    defaults of gmapping: 1.0 m, 0.5 rad, 0.5, 30 particles). ``resolution_m`` is the width of a
    cell. A thing in front that is no wider than ``bodies_m`` may be a teammate, and is removed from
    scans; 0: nothing is removed.
    """

    particles: int = 30
    least_particles: int = 8
    resolution_m: float = 0.05
    linear_update_m: float = 1.0
    angular_update_rad: float = 0.5
    resample_threshold: float = 0.5
    noise: OdometryNoise = OdometryNoise()
    laser: LaserGeometry = SICK_LMS291
    bodies_m: float = 0.0

    @property
    def fewest(self) -> int:
        """Particles at least: never more than at most."""
        return min(self.least_particles, self.particles)
