"""Logs of CARMEN: the odometry and laser scans of a real robot as text.

The lines that are read: ``FLASER n ranges.. x y theta odom_x odom_y odom_theta time host log_time``
and the newer ``ROBOTLASER1 type start field_of_view increment longest accuracy remission_mode n
ranges.. n remissions.. x y theta odom_x odom_y odom_theta tv rv safety(3) time host log_time``;
``ODOM x y theta tv rv accel ..`` is checked alone: a scan has the odometry of its instant.
``PARAM robot_front_laser_max m`` is the longest range. All other lines are skipped.
"""

from __future__ import annotations

import gzip
import math
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from desim.errors import InputError, printable
from desim.files import opened
from desim.imports.slam_logs.number_words import finite
from desim.robot.slam.settings import ScannerGeometry
from desim.robot.slam.transforms import compose, motion_between

_READ = ("FLASER", "ROBOTLASER1", "ODOM")
_MOST_BEAMS = 100_000
_AT_ONCE = 3  # numbers of ODOM that are read
# The laser of FLASER lines by its number of beams, as CARMEN has it: a SICK LMS of 180 or 100
# degrees, from its right; the last beam of an even number is left out.
_SICK_DEG = {180: (180.0, 1.0), 181: (180.0, 1.0), 360: (180.0, 0.5), 361: (180.0, 0.5),
             100: (100.0, 1.0), 101: (100.0, 1.0), 200: (100.0, 0.5), 201: (100.0, 0.5),
             400: (100.0, 0.25), 401: (100.0, 0.25)}
# Without a returning echo the laser reports its longest range, or a bit less.
_NO_RETURN = 0.98
_SAME_M, _SAME_RAD = 0.01, 0.01  # a laser is mounted where its pose on the robot varies no more


class CarmenLog(NamedTuple):
    """A log: ``times_s`` [scans], ``odometry`` [scans, 3] of the laser (x m, y m, yaw rad),
    ``ranges`` [scans, beams] in m, and the laser's geometry."""

    times_s: np.ndarray
    odometry: np.ndarray
    ranges: np.ndarray
    scanner: ScannerGeometry

    def first(self, scans: int) -> CarmenLog:
        """The log of its first scans."""
        return self._replace(times_s=self.times_s[:scans], odometry=self.odometry[:scans],
                             ranges=self.ranges[:scans])


class _Scan(NamedTuple):
    time_s: float
    laser: list[float]
    robot: list[float]
    ranges: np.ndarray
    angles: tuple[float, float, float]  # first, increment, longest range; 0 where it is not said


def read_carmen(path: Path) -> CarmenLog:
    """A log of CARMEN, plain or compressed with gzip. Raises ``InputError`` with file and line.

    Where a log has scans of both kinds, those of the kind that comes first are taken.
    """
    scans: list[_Scan] = []
    kind, longest_m = "", math.inf
    for number, line in _lines(path):
        words = line.split()
        where = f"{path}:{number}"
        if words[:2] == ["PARAM", "robot_front_laser_max"] and len(words) > 2:
            longest_m = finite(words[2:3], where, "PARAM robot_front_laser_max")[0]
        if not words or words[0] not in _READ:
            continue
        if words[0] == "ODOM":
            finite(_some(words, 1, _AT_ONCE, where, "x, y and theta"), where, "ODOM")
            continue
        if kind in ("", words[0]):
            kind = words[0]
            scan = (_flaser if kind == "FLASER" else _robotlaser)(words, where)
            if scans and len(scan.ranges) != len(scans[0].ranges):
                raise InputError(f"{where}: {kind} has {len(scan.ranges)} ranges, the first scan "
                                 f"{len(scans[0].ranges)}; wanted: one laser")
            scans.append(scan)
    if not scans:
        raise InputError(f"{path}: has no scan; wanted: a log of CARMEN with lines FLASER or "
                         "ROBOTLASER1")
    return _log(scans, longest_m)


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    """The lines of a file, numbered from 1."""
    try:
        with opened(path) as file:
            packed = file.peek(2)[:2] == b"\x1f\x8b"
            with gzip.open(file, "rb") if packed else file as text:
                for number, line in enumerate(text, 1):
                    yield number, line.decode("ascii", "replace")
    except (OSError, EOFError, zlib.error) as error:
        reason = (error.strerror if isinstance(error, OSError) and error.strerror
                  else f"damaged: {error}")
        raise InputError(f"{path}: {reason}") from error


def _some(words: list[str], at: int, count: int, where: str, what: str) -> list[str]:
    """The ``count`` words from ``at`` on."""
    if len(words) < at + count:
        raise InputError(f"{where}: {words[0]} ends after {len(words) - 1} values; wanted: {what}, "
                         f"the values {at} to {at + count - 1}")
    return words[at:at + count]


def _count(words: list[str], at: int, where: str, what: str) -> int:
    """A number of values that follow."""
    word = _some(words, at, 1, where, f"the number of {what}")[0]
    if not word.isdecimal() or int(word) > _MOST_BEAMS:
        raise InputError(f"{where}: {words[0]} has {printable(word)!r} as the number of {what}; "
                         f"allowed: 0 to {_MOST_BEAMS}")
    return int(word)


def _flaser(words: list[str], where: str) -> _Scan:
    count = _count(words, 1, where, "ranges")
    ranges = _some(words, 2, count, where, f"{count} ranges")
    rest = _some(words, 2 + count, 7, where, "two poses and a time")
    values = finite(rest, where, "FLASER")
    return _Scan(values[6], values[:3], values[3:6],
                 np.array(finite(ranges, where, "FLASER")), (0.0, 0.0, 0.0))


def _robotlaser(words: list[str], where: str) -> _Scan:
    first, _, increment, longest = finite(_some(words, 2, 4, where, "the laser's angles"), where,
                                          "ROBOTLASER1")
    if increment == 0.0:
        raise InputError(f"{where}: ROBOTLASER1 has angles 0 apart; wanted: rad, not 0")
    count = _count(words, 8, where, "ranges")
    ranges = _some(words, 9, count, where, f"{count} ranges")
    at = 9 + count
    at += 1 + _count(words, at, where, "remissions")
    values = finite(_some(words, at, 12, where, "two poses and a time"), where, "ROBOTLASER1")
    return _Scan(values[11], values[:3], values[3:6],
                 np.array(finite(ranges, where, "ROBOTLASER1")), (first, increment, longest))


def _log(scans: list[_Scan], longest_m: float) -> CarmenLog:
    """The arrays of all scans. The poses are the laser's own, as those of published relations."""
    ranges = np.array([scan.ranges for scan in scans])
    first, increment, said_m = scans[0].angles
    beams = ranges.shape[1]
    if increment == 0.0:
        field, apart = _SICK_DEG.get(beams, (180.0, 180.0 / max(beams - 1, 1)))
        first, increment = math.radians(-0.5 * field), math.radians(apart)
    if said_m > 0.0:
        longest_m = min(longest_m, said_m)
    longest_m = min(longest_m, float(ranges.max(initial=0.0)))
    robot = np.array([scan.robot for scan in scans])
    mounts = motion_between(robot, np.array([scan.laser for scan in scans]))
    mount = np.median(mounts, axis=0)
    off = np.abs(mounts - mount)
    if (off[:, :2] > _SAME_M).any() or (off[:, 2] > _SAME_RAD).any():
        mount = np.zeros(3)  # the laser's pose is not odometry: somebody has corrected it
    return CarmenLog(np.array([scan.time_s for scan in scans]), compose(robot, mount), ranges,
                     ScannerGeometry(first, increment, longest_m=_NO_RETURN * longest_m))
