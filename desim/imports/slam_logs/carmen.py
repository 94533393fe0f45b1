"""Logs of CARMEN: the odometry and laser scans of a real robot as text.

The lines that are read: ``FLASER n ranges.. x y theta odom_x odom_y odom_theta time host log_time``
and the newer ``ROBOTLASER1 type start field_of_view increment longest accuracy remission_mode n
ranges.. n remissions.. x y theta odom_x odom_y odom_theta tv rv safety(3) time host log_time``;
``ODOM x y theta tv rv accel time host log_time`` is only checked, as a scan has the odometry of its
instant. ``RAWLASER1``, which begins as ``ROBOTLASER1`` does and ends ``n remissions.. time host
log_time``, has none: if a log has no other scans, these are placed on straight lines between
``ODOM``.
``PARAM robot_front_laser_max m`` is the longest range. All other lines are skipped.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from desim.errors import InputError, printable
from desim.imports.slam_logs.laser_log import LaserLog
from desim.imports.slam_logs.number_words import finite
from desim.ports.localization import LaserGeometry
from desim.robot.transforms import compose, motion_between
from desim.unpacking import lines

_READ = ("FLASER", "ROBOTLASER1", "RAWLASER1", "ODOM")
_MOST_BEAMS = 100_000
_AT_ONCE = 3  # numbers of ODOM that are read
_ODOM_TIME = 7  # its time, which a scan without a pose needs
# Odometry that moves farther between two scans has jumped: robots of logs drive slower than this,
# and clocks of logs are late by a part of a second (ours).
_FASTEST_MPS = 5.0
_LATE_M = 0.5
# The laser of FLASER lines by its number of beams, as CARMEN has it: a SICK LMS of 180 or 100
# degrees, from its right; the last beam of an even number is left out.
_SICK_DEG = {180: (180.0, 1.0), 181: (180.0, 1.0), 360: (180.0, 0.5), 361: (180.0, 0.5),
             100: (100.0, 1.0), 101: (100.0, 1.0), 200: (100.0, 0.5), 201: (100.0, 0.5),
             400: (100.0, 0.25), 401: (100.0, 0.25)}
# Without a returning echo the laser reports its longest range, or a bit less.
_NO_RETURN = 0.98
_SAME_M, _SAME_RAD = 0.01, 0.01  # a laser is mounted where its pose on the robot varies no more


class _Scan(NamedTuple):
    time_s: float
    laser: list[float]
    robot: list[float]
    ranges: np.ndarray
    angles: tuple[float, float, float]  # first, increment, longest range; 0 where it is not said
    where: str  # file and line


def read_carmen(path: Path) -> LaserLog:
    """A log of CARMEN, plain or compressed with gzip. Raises ``InputError`` with file and line.

    Where a log has scans of both kinds, those of the kind that comes first are taken; those without
    a pose, if there are no others. Scans that are stamped earlier than one before are left out.
    """
    scans: list[_Scan] = []
    raw: list[tuple[str, str]] = []
    odometry: list[list[float]] = []  # time, x, y, theta
    kind, longest_m, number = "", math.inf, 0
    for number, line in _lines(path):
        words = line.split()
        where = f"{path}:{number}"
        if words[:2] == ["PARAM", "robot_front_laser_max"] and len(words) > 2:
            longest_m = finite(words[2:3], where, "PARAM robot_front_laser_max")[0]
        if not words or words[0] not in _READ:
            continue
        if words[0] == "ODOM":
            place = finite(_some(words, 1, _AT_ONCE, where, "x, y and theta"), where, "ODOM")
            if len(words) > _ODOM_TIME:
                odometry.append([*finite(words[_ODOM_TIME:_ODOM_TIME + 1], where, "ODOM"), *place])
            continue
        if words[0] == "RAWLASER1":
            if not scans:
                raw.append((where, line))  # read where no others are
            continue
        if kind in ("", words[0]):
            kind = words[0]
            scan = (_flaser if kind == "FLASER" else _robotlaser)(words, where)
            scans.append(scan)
            _same_laser(scan, scans[0], kind)
    if not scans:
        scans = _placed(raw, odometry, f"{path}:{number}" if number else str(path))
    kept, late = _in_order(scans)
    return _log(kept, longest_m)._replace(warnings=(*late, *_jumps(kept)))


def _same_laser(scan: _Scan, first: _Scan, kind: str) -> None:
    if len(scan.ranges) != len(first.ranges):
        raise InputError(f"{scan.where}: {kind} has {len(scan.ranges)} ranges, the first scan "
                         f"{len(first.ranges)}; wanted: one laser")


def _in_order(scans: list[_Scan]) -> tuple[list[_Scan], list[str]]:
    """The scans whose stamps do not go backwards, and a warning if there are others."""
    newest = np.maximum.accumulate([scan.time_s for scan in scans]).tolist()
    late = [k for k, scan in enumerate(scans) if scan.time_s < newest[k]]
    if not late:
        return scans, []
    first = scans[late[0]]
    return [scan for k, scan in enumerate(scans) if scan.time_s >= newest[k]], [
        f"{first.where}: the time stamp is {newest[late[0]] - first.time_s:.3g} s earlier than one "
        f"before; {_counted(len(late), 'scan')} with such stamps left out"]


def _jumps(scans: list[_Scan]) -> list[str]:
    """A warning if odometry moves farther between two scans than a robot drives."""
    found = []
    for before, scan in pairwise(scans):
        way_m = math.dist(before.robot[:2], scan.robot[:2])
        if way_m > _LATE_M + _FASTEST_MPS * (scan.time_s - before.time_s):
            found.append((scan.where, way_m, scan.time_s - before.time_s))
    if not found:
        return []
    where, way_m, spent_s = found[0]
    return [f"{where}: the odometry moves {way_m:.3g} m in {spent_s:.3g} s, farther than a robot "
            f"drives; {_counted(len(found), 'such jump')} in the log"]


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'s' if count != 1 else ''}"


def _placed(raw: list[tuple[str, str]], odometry: list[list[float]], end: str) -> list[_Scan]:
    """Scans without a pose at those of the odometry, from its first to its last instant. ``end``
    of the log, for complaints."""
    if not raw:
        raise InputError(f"{end}: the log ends without a scan; wanted: a log of CARMEN with "
                         "lines FLASER, ROBOTLASER1, or RAWLASER1 and ODOM")
    table = np.array(sorted(odometry)).reshape(-1, 4)
    scans: list[_Scan] = []
    for where, line in raw:
        scan = _rawlaser(line.split(), where)
        if len(table) and table[0, 0] <= scan.time_s <= table[-1, 0]:
            columns = (table[:, 1], table[:, 2], np.unwrap(table[:, 3]))
            pose = [float(np.interp(scan.time_s, table[:, 0], column)) for column in columns]
            scans.append(scan._replace(laser=pose, robot=pose))
            _same_laser(scan, scans[0], "RAWLASER1")
    if not scans:
        raise InputError(f"{end}: the log ends, and no RAWLASER1 is within the time of lines "
                         "ODOM; wanted: scans with odometry")
    return scans


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    """The lines of a file, numbered from 1."""
    number = 0
    try:
        for number, line in lines(path):
            yield number, line.decode("ascii", "replace")
    except (OSError, EOFError, zlib.error) as error:
        if isinstance(error, OSError) and error.strerror:
            raise InputError(f"{path}: {error.strerror}") from error
        raise InputError(f"{path}:{number + 1}: damaged: {error}") from error


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
                 np.array(finite(ranges, where, "FLASER")), (0.0, 0.0, 0.0), where)


def _robotlaser(words: list[str], where: str) -> _Scan:
    ranges, angles, at = _beams(words, where)
    values = finite(_some(words, at, 12, where, "two poses and a time"), where, "ROBOTLASER1")
    return _Scan(values[11], values[:3], values[3:6], ranges, angles, where)


def _rawlaser(words: list[str], where: str) -> _Scan:
    """A scan whose poses are to be found yet."""
    ranges, angles, at = _beams(words, where)
    time_s = finite(_some(words, at, 1, where, "a time"), where, "RAWLASER1")[0]
    return _Scan(time_s, [], [], ranges, angles, where)


def _beams(words: list[str], where: str) -> tuple[np.ndarray, tuple[float, float, float], int]:
    """The ranges and angles of a scan of the newer kinds, and where its line goes on."""
    kind = words[0]
    first, _, increment, longest = finite(_some(words, 2, 4, where, "the laser's angles"), where,
                                          kind)
    if increment == 0.0:
        raise InputError(f"{where}: {kind} has angles 0 apart; wanted: rad, not 0")
    count = _count(words, 8, where, "ranges")
    ranges = _some(words, 9, count, where, f"{count} ranges")
    at = 9 + count
    at += 1 + _count(words, at, where, "remissions")
    return np.array(finite(ranges, where, kind)), (first, increment, longest), at


def _log(scans: list[_Scan], longest_m: float) -> LaserLog:
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
    return LaserLog(np.array([scan.time_s for scan in scans]), compose(robot, mount), ranges,
                     LaserGeometry(first, increment, longest_m=_NO_RETURN * longest_m))
