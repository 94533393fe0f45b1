"""All that is taken out of a ROS recording: poses, frames, maps, plans, walls, the log of links."""

from __future__ import annotations

from fnmatch import fnmatchcase
from math import isfinite
from pathlib import Path
from typing import NamedTuple

import numpy as np

from desim.errors import InputError
from desim.export.frames import FrameTree
from desim.export.link_log import DIAGNOSTICS, LINK
from desim.export.markers import ARRAY
from desim.export.ros_reader import Read, RosRecording
from desim.export.ros_types import Message
from desim.export.topics import GOAL, GRID, NUMBER, ODOMETRY, PATH, TRANSFORMS
from desim.export.trajectories import Given, plain_name
from desim.units import NS_PER_S

_COVARIANT = "geometry_msgs/msg/PoseWithCovarianceStamped"
_POSES = (GOAL, _COVARIANT)  # PoseStamped is a goal's type, too
_KINDS = (ODOMETRY, *_POSES, TRANSFORMS, "tf/msg/tfMessage", GRID, PATH, DIAGNOSTICS, ARRAY,
          NUMBER)
_LINE_LIST, _TRIANGLE_LIST, _FEET = 5, 11, " feet"
_LISTED = 12  # topics in an error

Corners = tuple[float, float, float, float]


class LinkNews(NamedTuple):
    """The news of one link: ``linked`` None, and -1, where they say nothing about it."""

    time_ns: int
    host: str
    other: str
    linked: bool | None
    messages: int
    size_bytes: int
    dropped: int
    latency_ns: int


class Gathered:
    """The content of the recording at ``path`` that desim can show; of poses and maps only topics
    that match ``pattern`` (``/*/odom``; None: all). Raises ``InputError`` for a file that cannot be
    read, and for one without trajectories."""

    def __init__(self, path: Path, pattern: str | None = None) -> None:
        self.odometry: dict[str, Given] = {}
        self.poses: dict[str, Given] = {}
        self.frames = FrameTree()
        self.grids: dict[str, list[tuple[int, Message]]] = {}
        self.plans: list[tuple[int, str, str, np.ndarray]] = []  # ns, topic, kind, [n, 2] m
        self.links: list[LinkNews] = []
        self.walls: list[tuple[int, dict[Corners, tuple[str, float]]]] = []  # standing from ns on
        self.explored: list[tuple[int, float]] = []  # ns, share
        self.start_ns, self.end_ns = 1 << 62, 0
        self._pattern = pattern
        self.file = RosRecording(path)
        for read in self.file.messages(_KINDS):
            self._take(read)
        self._check(path)

    @property
    def trajectories(self) -> dict[str, Given]:
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

    def _take(self, read: Read) -> None:
        message, topic = read.message, read.topic
        if read.kind == TRANSFORMS or read.kind == "tf/msg/tfMessage":
            for one in message.transforms:
                moved = one.transform
                self.frames.add(
                    self._when(one.header, read), one.header.frame_id.lstrip("/"),
                    one.child_frame_id.lstrip("/"), moved.translation.x, moved.translation.y,
                    _yaw(moved.rotation))
        elif read.kind == ARRAY:
            self._take_walls(read)
        elif read.kind == NUMBER:
            if topic == "/explored":  # as desim exports it; it has no stamp
                self.explored.append((read.time_ns, float(message.data)))
        elif read.kind == DIAGNOSTICS:
            time_ns = self._when(message.header, read)
            self.links += filter(None, (_news(time_ns, status) for status in message.status))
        elif read.kind == PATH:
            self.plans.append((self._when(message.header, read), topic, "plan", np.array(
                [(at.pose.position.x, at.pose.position.y) for at in message.poses])))
        elif read.kind == GRID:
            self.grids.setdefault(topic, []).append((self._when(message.header, read), message))
        elif read.kind == GOAL and "goal" in topic.rpartition("/")[2]:
            at = message.pose.position
            self.plans.append((self._when(message.header, read), topic, "goal",
                               np.array([(at.x, at.y)])))
        elif self._pattern is None or fnmatchcase(topic, self._pattern):
            self._take_pose(read)

    def _take_pose(self, read: Read) -> None:
        """Odometry, or another pose."""
        message = read.message
        pose = message.pose if read.kind == GOAL else message.pose.pose
        into = self.odometry if read.kind == ODOMETRY else self.poses
        given = into.setdefault(read.topic, Given(message.header.frame_id.lstrip("/"), []))
        row = (self._when(message.header, read), pose.position.x, pose.position.y,
               _yaw(pose.orientation))
        if all(map(isfinite, row)):
            given.rows.append(row)

    def _take_walls(self, read: Read) -> None:
        """The walls of a terrain that desim has exported."""
        markers = read.message.markers
        heights = {marker.ns: max(point.z for point in marker.points) for marker in markers
                   if marker.type == _TRIANGLE_LIST and marker.points}
        standing: dict[Corners, tuple[str, float]] = {}
        feet = [marker for marker in markers
                if marker.type == _LINE_LIST and marker.ns.endswith(_FEET)]
        for marker in feet:
            material = marker.ns.removesuffix(_FEET)
            for one, other in zip(marker.points[::2], marker.points[1::2], strict=True):
                standing[one.x, one.y, other.x, other.y] = material, heights.get(material, 2.0)
        if feet:
            self.walls.append((self._when(markers[0].header, read), standing))

    def _when(self, header: Message, read: Read) -> int:
        """The stamp of a message; when it was recorded, where it has none."""
        time_ns = int(header.stamp.sec) * NS_PER_S + int(header.stamp.nanosec) or read.time_ns
        self.start_ns, self.end_ns = min(self.start_ns, time_ns), max(self.end_ns, time_ns)
        return time_ns


def _yaw(turned: Message) -> float:
    """The heading of a quaternion."""
    return float(np.arctan2(2 * (turned.w * turned.z + turned.x * turned.y),
                            1 - 2 * (turned.y ** 2 + turned.z ** 2)))


def _news(time_ns: int, status: Message) -> LinkNews | None:
    """The news of a diagnostic status; None if it is not about a link."""
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
    return LinkNews(time_ns, plain_name(values["host"]), plain_name(values["other"]), linked,
                    messages, size_bytes, dropped, latency_ns)
