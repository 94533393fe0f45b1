"""Settings of SLAM, with the source of each default."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class ScannerGeometry:
    """The laser whose scans are processed: any number of beams, at equal angles.

    A range below ``shortest_m``, or of ``longest_m`` and above, is no return. ``mount``: the
    laser's pose on the robot (m, m, rad). The defaults are those of a SICK LMS 291 with 361 beams.
    """

    angle_min_rad: float = -0.5 * math.pi
    increment_rad: float = math.radians(0.5)
    shortest_m: float = 0.05
    longest_m: float = 80.0
    mount: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class OdometryNoise:
    """Standard deviations of the odometry between two processed scans: m per m and m per rad in
    each direction, rad per m and rad per rad of the heading, as gmapping has them (``srr``,
    ``str``, ``srt``, ``stt``: 0.1, 0.1, 0.2, 0.2), and the least ones. Odometry that is off by more
    than ``strayed`` in log-likelihood has failed; infinite for one that never does."""

    m_per_m: float = 0.1
    m_per_rad: float = 0.1
    rad_per_m: float = 0.1
    rad_per_rad: float = 0.2
    least_m: float = 0.02
    least_rad: float = 0.01
    strayed: float = 6.0


@dataclass(frozen=True)
class SlamSettings:
    """The settings of a particle filter for SLAM.

    A scan is processed after ``linear_update_m`` or ``angular_update_rad`` of motion; particles are
    drawn anew when their effective number falls below ``resample_threshold`` of them (the defaults
    of gmapping: 1.0 m, 0.5 rad, 0.5, 30 particles). ``resolution_m`` is the width of a cell.
    """

    particles: int = 30
    resolution_m: float = 0.05
    linear_update_m: float = 1.0
    angular_update_rad: float = 0.5
    resample_threshold: float = 0.5
    noise: OdometryNoise = OdometryNoise()
    scanner: ScannerGeometry = ScannerGeometry()
