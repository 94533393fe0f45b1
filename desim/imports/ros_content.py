"""The content of a ROS recording: poses, frames, maps, plans, walls and the log of links."""

from __future__ import annotations

from collections.abc import Callable
from fnmatch import fnmatchcase
from functools import partial
from math import isfinite
from pathlib import Path

import numpy as np

from desim.errors import InputError
from desim.export.ros.link_diagnostics import LINK
from desim.export.ros.markers import FEET, LINE_LIST, TRIANGLE_LIST
from desim.export.ros.message_types import (
    DIAGNOSTIC_ARRAY,
    FLOAT64,
    MARKER_ARRAY,
    OCCUPANCY_GRID,
    ODOMETRY,
    PATH,
    POSE_STAMPED,
    TF_MESSAGE,
    Message,
    TopicMessage,
)
from desim.export.ros.topics import EXPLORED
from desim.imports.frame_tree import ALWAYS_NS, FrameTree
from desim.imports.recording_clock import RecordingClock
from desim.imports.recording_content import Corners, LinkEntry, RecordingContent
from desim.imports.ros_reader import RosRecording
from desim.imports.trajectories import BASES, TopicPoses, plain_name, tracks
from desim.units import NS_PER_S

_COVARIANT = "geometry_msgs/msg/PoseWithCovarianceStamped"
_OLD_TF_MESSAGE = "tf/msg/tfMessage"  # of ROS before tf2
TRANSFORMS = (TF_MESSAGE, _OLD_TF_MESSAGE)
_KINDS = (ODOMETRY, POSE_STAMPED, _COVARIANT, *TRANSFORMS, OCCUPANCY_GRID, PATH, DIAGNOSTIC_ARRAY,
          MARKER_ARRAY, FLOAT64)
_STATIC = "tf_static"
_LISTED = 12  # topics in an error


def read_ros(path: Path, pattern: str | None = None) -> RecordingContent:
    """The content of the recording at ``path``; of poses only topics that match ``pattern``
    (``/*/odom``; None: all). Raises ``InputError`` for a file that cannot be read, and for one
    without trajectories."""
    return _RosContent(path, pattern).content


class FrameReader:
    """The transforms and the clock of a recording that is read, message by message."""

    def __init__(self) -> None:
        self.clock, self.frames = RecordingClock(), FrameTree()
        self.turned: set[str] = set()  # frames whose z axis points down in their parents

    def take_transforms(self, read: TopicMessage) -> None:
        """Add the transforms of a message to the frames. Static ones hold always: their stamps are
        of their first publication, which may be long before the recording, or none."""
        static = read.topic.rpartition("/")[2] == _STATIC
        for one in read.message.transforms:
            moved = one.transform
            row = (one.header.frame_id.lstrip("/"), one.child_frame_id.lstrip("/"),
                   moved.translation.x, moved.translation.y, yaw_of(moved.rotation))
            if moved.rotation.x ** 2 + moved.rotation.y ** 2 > 0.5:
                self.turned.add(row[1])
            if static:
                self.frames.add(ALWAYS_NS, *row)
            else:
                self.date(one.header, read, partial(_added, self.frames, row), moving=True)

    def date(self, header: Message, read: TopicMessage, put: Callable[[int], object],
             moving: bool = False) -> None:
        """Have ``put`` called with the instant of a message, when all are read."""
        self.clock.add(int(header.stamp.sec) * NS_PER_S + int(header.stamp.nanosec), read.time_ns,
                       moving, put)


def _added(frames: FrameTree, row: tuple[str, str, float, float, float], time_ns: int) -> None:
    frames.add(time_ns, *row)


class _RosContent(FrameReader):
    """A recording that is read into ``content``."""

    def __init__(self, path: Path, pattern: str | None) -> None:
        super().__init__()
        self.content = content = RecordingContent()
        self._odometry: dict[str, TopicPoses] = {}
        self._poses: dict[str, TopicPoses] = {}
        self._pattern = pattern
        file = RosRecording(path)
        for read in file.messages(_KINDS):
            self._take(read)
        others = self.clock.settle()
        taken, left = (self._odometry, self._poses) if self._odometry else (self._poses, {})
        given = {topic: poses for topic, poses in taken.items() if poses.rows}
        content.tracks = tracks(path, given, self.frames, by_frames=pattern is None)
        content.broken = file.broken
        if not content.tracks:
            raise self._nothing(path, file)
        if left:
            content.notes.append(f"left out beside odometry: {', '.join(left)}; --topic takes them")
        if others:
            content.notes.append(f"{others} stamps are of another clock: dated by when they were "
                                 "recorded")

    def _nothing(self, path: Path, file: RosRecording) -> InputError:
        listed = ", ".join(f"{topic} ({kind})"
                           for topic, kind in list(file.topics.items())[:_LISTED])
        which = f" that match {self._pattern!r}" if self._pattern else ""
        frames = self.frames.children()
        moves = (f"; its transforms are of {', '.join(frames[:_LISTED])}"
                 f"{', ...' if len(frames) > _LISTED else ''}; a robot's frame is "
                 f"{', '.join(BASES[:-1])} or {BASES[-1]}, and moves" if frames else "")
        return InputError(
            f"{path}: no trajectories{which}; wanted: topics with Odometry, PoseStamped, "
            f"PoseWithCovarianceStamped or TFMessage; it has {listed or 'no topics'}"
            f"{', ...' if len(file.topics) > _LISTED else ''}{moves}"
            f"{f', and is damaged: {file.broken}' if file.broken else ''}")

    def _take(self, read: TopicMessage) -> None:
        message, topic, content = read.message, read.topic, self.content
        if read.kind in TRANSFORMS:
            self.take_transforms(read)
        elif read.kind == MARKER_ARRAY:
            self._take_walls(read)
        elif read.kind == FLOAT64:
            if topic == EXPLORED:  # as desim exports it; it has no stamp
                share = float(message.data)
                self.clock.add(0, read.time_ns, False,
                               lambda time_ns: content.explored.append((time_ns, share)))
        elif read.kind == DIAGNOSTIC_ARRAY:
            for entry in filter(None, map(_link_entry, message.status)):
                self.date(message.header, read, partial(_dated, content.links, entry))
        elif read.kind == PATH:
            self._take_plan(read, "plan", [(at.pose.position.x, at.pose.position.y)
                                           for at in message.poses])
        elif read.kind == OCCUPANCY_GRID:
            self.date(message.header, read, lambda time_ns: content.grids.setdefault(
                topic, []).append((time_ns, message)))
        elif read.kind == POSE_STAMPED and "goal" in topic.rpartition("/")[2]:
            self._take_plan(read, "goal", [(message.pose.position.x, message.pose.position.y)])
        elif self._pattern is None or any(fnmatchcase(one, self._pattern)
                                          for one in (topic, f"/{topic.lstrip('/')}")):
            self._take_pose(read)

    def _take_plan(self, read: TopicMessage, kind: str, places: list[tuple[float, float]]) -> None:
        self.date(read.message.header, read, lambda time_ns: self.content.plans.append(
            (time_ns, read.topic, kind, np.array(places))))

    def _take_pose(self, read: TopicMessage) -> None:
        """Odometry, or another pose."""
        message = read.message
        pose = message.pose if read.kind == POSE_STAMPED else message.pose.pose
        into = self._odometry if read.kind == ODOMETRY else self._poses
        rows = into.setdefault(read.topic,
                               TopicPoses(message.header.frame_id.lstrip("/"), [])).rows
        place = pose.position.x, pose.position.y, yaw_of(pose.orientation)
        if all(map(isfinite, place)):
            self.date(message.header, read, lambda time_ns: rows.append((time_ns, *place)),
                      moving=True)

    def _take_walls(self, read: TopicMessage) -> None:
        """The walls of a terrain that desim has exported."""
        markers = read.message.markers
        heights = {marker.ns: max(point.z for point in marker.points) for marker in markers
                   if marker.type == TRIANGLE_LIST and marker.points}
        standing: dict[Corners, tuple[str, float]] = {}
        feet = [marker for marker in markers
                if marker.type == LINE_LIST and marker.ns.endswith(FEET)]
        for marker in feet:
            material = marker.ns.removesuffix(FEET)
            for one, other in zip(marker.points[::2], marker.points[1::2], strict=True):
                standing[one.x, one.y, other.x, other.y] = material, heights.get(material, 2.0)
        if feet:
            self.date(markers[0].header, read,
                      lambda time_ns: self.content.walls.append((time_ns, standing)))


def yaw_of(turned: Message) -> float:
    """The heading of a quaternion."""
    return float(np.arctan2(2 * (turned.w * turned.z + turned.x * turned.y),
                            1 - 2 * (turned.y ** 2 + turned.z ** 2)))


def _dated(links: list[LinkEntry], entry: LinkEntry, time_ns: int) -> None:
    links.append(entry._replace(time_ns=time_ns))


def _link_entry(status: Message) -> LinkEntry | None:
    """The entry that a diagnostic status is, not dated; None if it is not about a link."""
    values = {value.key: value.value for value in status.values}
    if not status.name.startswith(LINK) or not values.keys() >= {"host", "other"}:
        return None
    try:
        latency_ns = round(float(values.get("latency_ms", "0")) * 1e6)
        messages, size_bytes, dropped = (int(values.get(key, "0"))
                                         for key in ("messages", "bytes", "dropped"))
    except ValueError:
        return None
    linked = {"true": True, "false": False}.get(values.get("linked", "").lower())
    return LinkEntry(0, plain_name(values["host"]), plain_name(values["other"]), linked,
                     messages, size_bytes, dropped, latency_ns)
