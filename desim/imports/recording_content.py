"""The content of a ROS recording: poses, frames, maps, plans, walls and the log of links."""

from __future__ import annotations

from fnmatch import fnmatchcase
from math import isfinite
from pathlib import Path
from typing import NamedTuple

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
from desim.imports.frame_tree import FrameTree
from desim.imports.ros_reader import RosRecording
from desim.imports.trajectories import TopicPoses, plain_name
from desim.units import NS_PER_S

_COVARIANT = "geometry_msgs/msg/PoseWithCovarianceStamped"
_OLD_TF_MESSAGE = "tf/msg/tfMessage"  # of ROS before tf2
_KINDS = (ODOMETRY, POSE_STAMPED, _COVARIANT, TF_MESSAGE, _OLD_TF_MESSAGE, OCCUPANCY_GRID, PATH,
          DIAGNOSTIC_ARRAY, MARKER_ARRAY, FLOAT64)
_LISTED = 12  # topics in an error

Corners = tuple[float, float, float, float]


class LinkEntry(NamedTuple):
    """An entry of a recording's log of links: the messages since the entry before, their bytes
    together and their mean latency, and whether frames get through (``linked``; None: it does not
    say)."""

    time_ns: int
    host: str
    other: str
    linked: bool | None
    messages: int
    size_bytes: int
    dropped: int
    latency_ns: int


class RecordingContent:
    """The content of the recording at ``path`` that desim can show; of poses and maps only topics
    that match ``pattern`` (``/*/odom``; None: all). Raises ``InputError`` for a file that cannot be
    read, and for one without trajectories."""

    def __init__(self, path: Path, pattern: str | None = None) -> None:
        self.odometry: dict[str, TopicPoses] = {}
        self.poses: dict[str, TopicPoses] = {}
        self.frames = FrameTree()
        self.grids: dict[str, list[tuple[int, Message]]] = {}
        self.plans: list[tuple[int, str, str, np.ndarray]] = []  # ns, topic, kind, [n, 2] m
        self.links: list[LinkEntry] = []
        self.walls: list[tuple[int, dict[Corners, tuple[str, float]]]] = []  # standing from ns on
        self.explored: list[tuple[int, float]] = []  # ns, share
        self.start_ns, self.end_ns = 1 << 62, 0
        self._pattern = pattern
        self.file = RosRecording(path)
        for read in self.file.messages(_KINDS):
            self._take(read)
        self._check(path)

    @property
    def trajectories(self) -> dict[str, TopicPoses]:
        """Poses by topic: odometry, else other poses."""
        found = self.odometry or self.poses
        return {topic: given for topic, given in found.items() if given.rows}

    def _check(self, path: Path) -> None:
        topics = self.file.topics
        if self.trajectories or not self._pattern and self.frames.children():
            return
        listed = ", ".join(f"{topic} ({kind})" for topic, kind in list(topics.items())[:_LISTED])
        which = f" that match {self._pattern!r}" if self._pattern else ""
        raise InputError(
            f"{path}: no trajectories{which}; wanted: topics with Odometry, PoseStamped, "
            f"PoseWithCovarianceStamped or TFMessage; it has {listed or 'no topics'}"
            f"{', ...' if len(topics) > _LISTED else ''}"
            f"{f', and is damaged: {self.file.broken}' if self.file.broken else ''}")

    def _take(self, read: TopicMessage) -> None:
        message, topic = read.message, read.topic
        if read.kind in (TF_MESSAGE, _OLD_TF_MESSAGE):
            for one in message.transforms:
                moved = one.transform
                self.frames.add(
                    self._when(one.header, read), one.header.frame_id.lstrip("/"),
                    one.child_frame_id.lstrip("/"), moved.translation.x, moved.translation.y,
                    _yaw(moved.rotation))
        elif read.kind == MARKER_ARRAY:
            self._take_walls(read)
        elif read.kind == FLOAT64:
            if topic == EXPLORED:  # as desim exports it; it has no stamp
                self.explored.append((read.time_ns, float(message.data)))
        elif read.kind == DIAGNOSTIC_ARRAY:
            time_ns = self._when(message.header, read)
            self.links += filter(None, (_link_entry(time_ns, status) for status in message.status))
        elif read.kind == PATH:
            self.plans.append((self._when(message.header, read), topic, "plan", np.array(
                [(at.pose.position.x, at.pose.position.y) for at in message.poses])))
        elif read.kind == OCCUPANCY_GRID:
            self.grids.setdefault(topic, []).append((self._when(message.header, read), message))
        elif read.kind == POSE_STAMPED and "goal" in topic.rpartition("/")[2]:
            at = message.pose.position
            self.plans.append((self._when(message.header, read), topic, "goal",
                               np.array([(at.x, at.y)])))
        elif self._pattern is None or fnmatchcase(topic, self._pattern):
            self._take_pose(read)

    def _take_pose(self, read: TopicMessage) -> None:
        """Odometry, or another pose."""
        message = read.message
        pose = message.pose if read.kind == POSE_STAMPED else message.pose.pose
        into = self.odometry if read.kind == ODOMETRY else self.poses
        given = into.setdefault(read.topic, TopicPoses(message.header.frame_id.lstrip("/"), []))
        row = (self._when(message.header, read), pose.position.x, pose.position.y,
               _yaw(pose.orientation))
        if all(map(isfinite, row)):
            given.rows.append(row)

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
            self.walls.append((self._when(markers[0].header, read), standing))

    def _when(self, header: Message, read: TopicMessage) -> int:
        """The stamp of a message; when it was recorded, where it has none."""
        time_ns = int(header.stamp.sec) * NS_PER_S + int(header.stamp.nanosec) or read.time_ns
        self.start_ns, self.end_ns = min(self.start_ns, time_ns), max(self.end_ns, time_ns)
        return time_ns


def _yaw(turned: Message) -> float:
    """The heading of a quaternion."""
    return float(np.arctan2(2 * (turned.w * turned.z + turned.x * turned.y),
                            1 - 2 * (turned.y ** 2 + turned.z ** 2)))


def _link_entry(time_ns: int, status: Message) -> LinkEntry | None:
    """The entry that a diagnostic status is; None if it is not about a link."""
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
    return LinkEntry(time_ns, plain_name(values["host"]), plain_name(values["other"]), linked,
                     messages, size_bytes, dropped, latency_ns)
