"""The laser scans and the odometry of a ROS recording, as a log for SLAM."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from desim.errors import InputError
from desim.export.ros.message_types import LASER_SCAN, ODOMETRY, Message, TopicMessage
from desim.imports.ros_content import TRANSFORMS, FrameReader, yaw_of
from desim.imports.ros_reader import RosRecording
from desim.imports.slam_logs.laser_log import LaserLog
from desim.imports.trajectories import in_order, is_base
from desim.ports.localization import LaserGeometry
from desim.robot.transforms import compose
from desim.units import NS_PER_S

_ODOM = "odom"  # the frame of odometry (REP 105)
_NO_RETURN = 0.98  # as of CARMEN's logs
_LISTED = 8


def read_scans(path: Path, topic: str | None = None) -> LaserLog:
    """The scans of the recording at ``path`` on ``topic`` (None: the only one), with the laser's
    pose by odometry: a topic with Odometry, else transforms from a frame ``odom``. A beam that
    reads nothing, or less than ``range_min``, has met nothing, as slam_gmapping of ROS has it.
    Raises ``InputError``."""
    read = _Scans(path)
    scans = read.chosen(topic)
    times_ns, poses, warnings = read.laser_poses(scans[0][1].header.frame_id.lstrip("/"))
    inside = [(time_ns, scan) for time_ns, scan in scans if times_ns[0] <= time_ns <= times_ns[-1]]
    if not inside:
        raise InputError(f"{path}: no laser scan is within the time of the odometry")
    if len(inside) < len(scans):
        warnings.append(f"{path}: {len(scans) - len(inside)} scans are before or after the "
                        "odometry, and left out")
    at_ns = np.array([time_ns for time_ns, _ in inside], np.int64)
    columns = (poses[:, 0], poses[:, 1], np.unwrap(poses[:, 2]))
    placed = np.stack([np.interp(at_ns - times_ns[0], times_ns - times_ns[0], column)
                       for column in columns], axis=-1)
    first = inside[0][1]
    ranges = np.array([_ranges(scan, first) for _, scan in inside])
    seen_m = ranges[np.isfinite(ranges)]
    longest_m = min(float(seen_m.max(initial=0.0)), float(first.range_max) or np.inf)
    if not longest_m > 0.0:
        raise InputError(f"{path}: no laser scan has met anything")
    ranges = np.minimum(ranges, longest_m)
    low, step = float(first.angle_min), float(first.angle_increment)
    if read.is_upside_down(first.header.frame_id.lstrip("/")):
        ranges, low = ranges[:, ::-1], -(low + step * (ranges.shape[1] - 1))
    return LaserLog(at_ns / NS_PER_S, placed, ranges,
                    LaserGeometry(low, step, longest_m=_NO_RETURN * longest_m), tuple(warnings))


def _ranges(scan: Message, first: Message) -> np.ndarray:
    """[beams] m, infinite without a return. Some lasers' scans differ by a few beams: each beam of
    the ``first`` scan is the nearest one of this."""
    ranges = np.asarray(scan.ranges, float)
    with np.errstate(invalid="ignore"):
        met = (ranges >= scan.range_min) & (ranges <= scan.range_max)
    ranges = np.where(met, ranges, np.inf)
    if len(ranges) == len(first.ranges):
        return ranges
    angles = first.angle_min + first.angle_increment * np.arange(len(first.ranges))
    at = np.rint((angles - scan.angle_min) / scan.angle_increment).astype(int)
    there = (at >= 0) & (at < len(ranges))
    return np.where(there, np.append(ranges, np.inf)[np.where(there, at, -1)], np.inf)


class _Scans(FrameReader):
    """The scans and odometry of a recording, by topic."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._path = path
        self._scans: dict[str, list[tuple[int, Message]]] = {}
        self._odometry: dict[str, list[tuple[int, float, float, float]]] = {}
        file = RosRecording(path)
        for read in file.messages((LASER_SCAN, ODOMETRY, *TRANSFORMS)):
            self._take(read)
        self.clock.settle()
        self._broken = [f"{path}: damaged, and read as far as it can be: {file.broken}"
                        ] if file.broken else []

    def _take(self, read: TopicMessage) -> None:
        message = read.message
        if read.kind in TRANSFORMS:
            self.take_transforms(read)
        elif read.kind == LASER_SCAN:
            scans = self._scans.setdefault(read.topic, [])
            if len(message.ranges) and message.angle_increment:
                self.date(message.header, read,
                          lambda time_ns: scans.append((time_ns, message)), moving=True)
        else:
            pose = message.pose.pose
            rows = self._odometry.setdefault(read.topic, [])
            place = pose.position.x, pose.position.y, yaw_of(pose.orientation)
            if np.isfinite(place).all():
                self.date(message.header, read,
                          lambda time_ns: rows.append((time_ns, *place)), moving=True)

    def chosen(self, topic: str | None) -> list[tuple[int, Message]]:
        """The scans on a topic, by time."""
        there = [name for name, scans in self._scans.items() if scans]
        if topic is None and len(there) == 1:
            topic = there[0]
        if topic not in there:
            what = "no topic" if topic is None and not there else \
                f"{len(there)} topics" if topic is None else f"no topic {topic}"
            raise InputError(f"{self._path}: {what} with laser scans; wanted: one topic with "
                             f"LaserScan{', by --topic' if there else ''}; it has "
                             f"{', '.join(there[:_LISTED]) or 'none'}")
        return sorted(self._scans[topic], key=lambda row: row[0])

    def laser_poses(self, frame: str) -> tuple[np.ndarray, np.ndarray, list[str]]:
        """[n] ns, and [n, 3] the poses of the laser's ``frame`` then by odometry; warnings."""
        above, warnings = list(self.frames.ancestors(frame)), list(self._broken)
        given = {topic: rows for topic, rows in self._odometry.items() if rows}
        if given:
            topic, rows = next(iter(given.items()))
            if len(given) > 1:
                warnings.append(f"{self._path}: the odometry is that of {topic}; it has "
                                f"{', '.join(given)}")
            times_ns, poses = in_order([row[0] for row in rows], np.array(rows, float)[:, 1:])
            base = next(filter(is_base, above), None)
            if base is None and not is_base(frame):
                warnings.append(f"{self._path}: no transform from {frame} to base_link; the laser "
                                "is taken to be in the middle of the robot")
                return times_ns, poses, warnings
            return times_ns, compose(poses, self.frames.within(
                frame, np.zeros((len(times_ns), 3)), times_ns, base)), warnings
        chain = [frame, *above]
        at = next((k for k, one in enumerate(chain) if one.rpartition("/")[2] == _ODOM), 0)
        # The robot's frame moves; frames on the robot may be repeated at other times.
        times_ns = self.frames.times_ns(chain[at - 1]) if at else np.empty(0, np.int64)
        if not len(times_ns):
            raise InputError(f"{self._path}: no odometry; wanted: a topic with Odometry, or "
                             f"transforms from {_ODOM} to {frame}, the frame of the laser")
        times_ns = np.unique(times_ns)
        return times_ns, self.frames.within(frame, np.zeros((len(times_ns), 3)), times_ns,
                                            chain[at]), warnings

    def is_upside_down(self, frame: str) -> bool:
        """Whether a laser is mounted so that its beams turn clockwise."""
        return sum(one in self.turned for one in (frame, *self.frames.ancestors(frame))) % 2 == 1
