"""The contents of messages, and their bytes in ROS 1.

A content is any object with ``size_bytes``: the serialized size of its ROS message, without the
4 bytes that TCPROS puts in front. ``Lazy`` is content that is computed when it is read.
Frame ids count as the names on the paper's robots (``/p3dx0_tf/odom``); the sizes are the message
definitions' own arithmetic, e.g. 797 B for a scan of 180 beams and 738 B for an odometry message.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np

MAP_FRAME_BYTES = len("/p3dx0_tf/map")
ODOM_FRAME_BYTES = len("/p3dx0_tf/odom")
BASE_FRAME_BYTES = len("/p3dx0_tf/base_footprint")
BASE_LINK_FRAME_BYTES = len("/p3dx0_tf/base_link")
LASER_FRAME_BYTES = len("/p3dx0_tf/base_laser_link")


class Content(Protocol):
    """Anything that can be published."""

    @property
    def size_bytes(self) -> int: ...


def laser_scan_bytes(beams: int) -> int:
    """sensor_msgs/LaserScan without intensities: 52 + frame id + 4 per range."""
    return 52 + LASER_FRAME_BYTES + 4 * beams


def occupancy_grid_bytes(cells: int) -> int:
    """nav_msgs/OccupancyGrid: 96 + frame id + one byte a cell."""
    return 96 + MAP_FRAME_BYTES + cells


def tf_message_bytes(frame_bytes: int, child_bytes: int) -> int:
    """tf/tfMessage with one transform: 80 + frame id + child frame id."""
    return 80 + frame_bytes + child_bytes


ODOMETRY_BYTES = 700 + ODOM_FRAME_BYTES + BASE_FRAME_BYTES  # nav_msgs/Odometry
TWIST_BYTES = 48  # geometry_msgs/Twist
POSE_STAMPED_BYTES = 72 + MAP_FRAME_BYTES  # geometry_msgs/PoseStamped
FLOAT64_BYTES = 8  # std_msgs/Float64


class Lazy:
    """Content whose size is known at birth and whose value is computed at the first reading.

    ``compute(*about)`` must be a pure function of immutable things, so that reading at birth, at
    delivery or never makes no difference to anything else.
    """

    __slots__ = ("size_bytes", "compute", "value", "about")

    def __init__(self, size_bytes: int, compute: Callable[..., object], *about: object) -> None:
        self.size_bytes = size_bytes
        self.compute: Callable[..., object] | None = compute  # None: ``value`` is the result
        self.value: Any = None
        self.about = about


class Filler(NamedTuple):
    """Content of which only the size matters."""

    size_bytes: int


class LaserScan(NamedTuple):
    """One sweep. ``ranges`` [beams] float32 m; a beam that met nothing reads ``range_max_m``.
    Beam i points to ``angle_min_rad + i * angle_increment_rad`` from the robot's heading;
    (``x_m``, ``y_m``) is the laser's place on the robot, ahead and to the left of its middle.
    ``is_lowest``: no laser of the robot is lower and sees what this one looks over."""

    stamp_ns: int
    ranges: np.ndarray
    angle_min_rad: float
    angle_increment_rad: float
    range_max_m: float
    x_m: float = 0.0
    y_m: float = 0.0
    is_lowest: bool = True

    @property
    def size_bytes(self) -> int:
        return laser_scan_bytes(len(self.ranges))


@lru_cache
def no_return_m(range_max_m: float) -> float:
    """The range (m) from which on a beam met nothing: a float32, as ranges are, so that no return
    turns into a hit by rounding."""
    return float(np.float32(range_max_m))


class _StampedPose(NamedTuple):
    stamp_ns: int
    x_m: float
    y_m: float
    yaw_rad: float


class Pose(_StampedPose):
    """A pose in the map frame, from odometry or localization (nav_msgs/Odometry in size)."""

    __slots__ = ()
    size_bytes: ClassVar[int] = ODOMETRY_BYTES


class _Velocity(NamedTuple):
    forward_mps: float
    left_mps: float
    turn_radps: float


class Twist(_Velocity):
    """The velocity that a controller wants."""

    __slots__ = ()
    size_bytes: ClassVar[int] = TWIST_BYTES


@dataclass(frozen=True, slots=True)
class Goal:
    """A place to drive to (geometry_msgs/PoseStamped); NaN as coordinates means: stop."""

    x_m: float
    y_m: float
    size_bytes: ClassVar[int] = POSE_STAMPED_BYTES


@dataclass(frozen=True, slots=True)
class GoalResult:
    """The end of the drive to a goal (actionlib_msgs/GoalStatus in size)."""

    x_m: float
    y_m: float
    reached: bool
    size_bytes: ClassVar[int] = 48


def point_cloud_bytes(points: int) -> int:
    """sensor_msgs/PointCloud without channels: 24 + frame id + 12 per point."""
    return 24 + BASE_LINK_FRAME_BYTES + 12 * points


@dataclass(frozen=True, slots=True)
class SonarReadings:
    """A range of each transducer of a sonar, as a scan of one beam along its axis (RosAria and p2os
    publish these points as sensor_msgs/PointCloud)."""

    scans: tuple[LaserScan, ...]

    @property
    def size_bytes(self) -> int:
        return point_cloud_bytes(len(self.scans))


@dataclass(frozen=True, slots=True)
class Bump:
    """A contact began (kobuki_msgs/BumperEvent in size: which bumper, and its state)."""

    stamp_ns: int
    size_bytes: ClassVar[int] = 2


@dataclass(frozen=True, slots=True)
class Empty:
    """std_msgs/Empty: something happened."""

    size_bytes: ClassVar[int] = 0


EMPTY = Empty()  # all are equal


@dataclass(frozen=True, slots=True)
class Float64:
    """std_msgs/Float64: a travelled distance, say."""

    value: float
    size_bytes: ClassVar[int] = FLOAT64_BYTES
