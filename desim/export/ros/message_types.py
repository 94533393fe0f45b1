"""ROS messages and their bytes, of ROS 1 and of ROS 2, by rosbags."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from desim.units import NS_PER_S

# The types of topics' messages.
DIAGNOSTIC_ARRAY = "diagnostic_msgs/msg/DiagnosticArray"
FLOAT64 = "std_msgs/msg/Float64"
LASER_SCAN = "sensor_msgs/msg/LaserScan"
MARKER_ARRAY = "visualization_msgs/msg/MarkerArray"
OCCUPANCY_GRID = "nav_msgs/msg/OccupancyGrid"
ODOMETRY = "nav_msgs/msg/Odometry"
PATH = "nav_msgs/msg/Path"
POSE_STAMPED = "geometry_msgs/msg/PoseStamped"
RANGE = "sensor_msgs/msg/Range"
TF_MESSAGE = "tf2_msgs/msg/TFMessage"  # not among those of ROS 1 that rosbags brings along

# The press or release of one of a Kobuki's three bumpers; its package by the version of ROS.
_BUMPER_EVENT = {1: "kobuki_msgs/msg/BumperEvent", 2: "kobuki_ros_interfaces/msg/BumperEvent"}
_BUMPER_FIELDS = """uint8 LEFT=0
uint8 CENTER=1
uint8 RIGHT=2
uint8 RELEASED=0
uint8 PRESSED=1
uint8 bumper
uint8 state
"""

_ZERO = {"string": "", "bool": False, "float32": 0.0, "float64": 0.0}

Message = Any  # a message of rosbags, whose classes are made at run time
Timed = tuple[int, Message]  # with the instant of its record


class TopicMessage(NamedTuple):
    """A message of type ``kind`` on a topic of a recording, and the instant of its record there."""

    time_ns: int
    topic: str
    kind: str
    message: Message


class RosTypes:
    """The message types of ROS ``version`` 1 (noetic) or 2 (humble)."""

    def __init__(self, version: int) -> None:
        self.version = version
        self.store = get_typestore(Stores.ROS1_NOETIC if version == 1 else Stores.ROS2_HUMBLE)
        if TF_MESSAGE not in self.store.types:
            self.store.register(get_types_from_msg(
                "geometry_msgs/TransformStamped[] transforms", TF_MESSAGE))
        self.bumper_event = _BUMPER_EVENT[version]
        self.store.register(get_types_from_msg(_BUMPER_FIELDS, self.bumper_event))
        self._known = cache(self._looked_up)

    def make(self, kind: str, **given: object) -> Message:
        """A message of type ``nav_msgs/msg/Odometry``; fields that are not given are zero."""
        made, defaults = self._known(kind)
        return made(**{**defaults, **given})

    def header(self, time_ns: int, frame: str) -> Message:
        return self.make("std_msgs/msg/Header", stamp=self.time(time_ns), frame_id=frame)

    def time(self, time_ns: int) -> Message:
        seconds, rest_ns = divmod(time_ns, NS_PER_S)
        return self.make("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest_ns)

    def point(self, x_m: float, y_m: float, z_m: float = 0.0) -> Message:
        return self.make("geometry_msgs/msg/Point", x=x_m, y=y_m, z=z_m)

    def vector(self, x: float, y: float, z: float = 0.0) -> Message:
        return self.make("geometry_msgs/msg/Vector3", x=x, y=y, z=z)

    def turned(self, yaw_rad: float) -> Message:
        """The quaternion of a heading."""
        return self.make("geometry_msgs/msg/Quaternion", z=float(np.sin(yaw_rad / 2)),
                         w=float(np.cos(yaw_rad / 2)))

    def pose(self, x_m: float, y_m: float, yaw_rad: float = 0.0) -> Message:
        return self.make("geometry_msgs/msg/Pose", position=self.point(x_m, y_m),
                         orientation=self.turned(yaw_rad))

    def colour(self, red: float, green: float, blue: float, alpha: float = 1.0) -> Message:
        return self.make("std_msgs/msg/ColorRGBA", r=red, g=green, b=blue, a=alpha)

    def data(self, kind: str, message: Message) -> bytes:
        """A message as CDR (ROS 2) or as ROS 1 serializes it."""
        serialize = self.store.serialize_ros1 if self.version == 1 else self.store.serialize_cdr
        return bytes(serialize(message, kind))

    def definition(self, kind: str) -> str:
        """The text of a type's definition, with those of the types in it."""
        return str(self.store.generate_msgdef(kind, ros_version=self.version)[0])

    def _looked_up(self, kind: str) -> tuple[Callable[..., Message], dict[str, object]]:
        """The class of a type, and the zeros of its fields."""
        return self.store.types[kind], {name: self._zero(*field) for name, field
                                        in self.store.fielddefs[kind][1]}

    def _zero(self, node: Any, about: Any) -> object:
        """The zero of a field, as rosbags describes it: a name, a number, many of them."""
        match node.name:
            case "NAME":
                return self.make(about)
            case "BASE":
                return _ZERO.get(about[0], 0)
        (inner, kind), count = about
        if inner.name == "BASE" and kind[0] != "string":
            return np.zeros(count, "u1" if kind[0] == "byte" else kind[0])
        return [self._zero(inner, kind) for _ in range(count)]
