"""The bytes of ROS 2's messages: by the rules of CDR, and beside those of rosbags."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.export.ros.message_types import RosTypes
from desim.loop import facade_messages
from desim.middleware.contents import LaserScan, Pose
from desim.ports import GridSpec

pytest.importorskip("cyclonedds", reason="pip install 'desim[loop]'")
from desim.loop.ros2_messages import DEFINITIONS, fields, kind, make  # noqa: E402

ROS2 = RosTypes(2)
STAMP_NS = 1_767_225_610_250_000_000


def data(message):
    """As a writer of XCDR1 serializes it."""
    return message.serialize(use_version_2=False)


def test_numbers_and_texts_are_aligned_by_their_own_size():
    """CDR (CORBA 3.4, 9.3): after the four bytes of the encapsulation (little endian, RTPS 2.3,
    10.2), each number at a multiple of its size; a text is its length with the final zero, and the
    bytes. So a frame of 3 letters ends at 16, the child's of 1 letter at 22, and the first float64
    is at 24."""
    message = make("geometry_msgs/TransformStamped", {
        "header": {"stamp": STAMP_NS, "frame_id": "map"}, "child_frame_id": "o",
        "transform": {"translation": {"x": 1.5}, "rotation": {"w": 1.0}}})
    assert data(message) == b"\0\1\0\0" + (
        struct.pack("<iI", 1_767_225_610, 250_000_000) + struct.pack("<I", 4) + b"map\0"
        + struct.pack("<I", 2) + b"o\0" + b"\0\0"
        + struct.pack("<7d", 1.5, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))


def test_other_rules_would_be_seen():
    """The twin: XCDR2 aligns a float64 at 4: here at 28, where XCDR1 has it at 32."""
    message = make("geometry_msgs/TransformStamped", {
        "header": {"stamp": STAMP_NS, "frame_id": "map"}, "child_frame_id": "odom"})
    assert len(data(message)) == 4 + 32 + 56
    assert len(message.serialize(use_version_2=True)) == 4 + 28 + 56


def theirs(name, values):
    """The message of rosbags with these fields; lists as arrays of numpy."""
    package, _, message = name.partition("/")
    made = {}
    for field, declared in fields(name):
        if field not in values:
            continue
        value = values[field]
        if isinstance(value, dict):
            value = theirs(declared, value)
        elif declared == "builtin_interfaces/Time":
            value = ROS2.time(value)
        elif declared in ("float32[]", "int8[]"):
            value = np.array(value, declared[:-2])
        elif declared.endswith("[]"):
            value = [theirs(declared[:-2], one) for one in value]
        made[field] = value
    return ROS2.make(f"{package}/msg/{message}", **made)


NAMES = st.text("abcdefgh_", min_size=1, max_size=12)
METRES = st.floats(-1e3, 1e3)
POSES = st.builds(Pose, st.integers(0, 10**12), METRES, METRES, st.floats(-3.1, 3.1))
SCANS = st.builds(
    LaserScan, st.integers(0, 10**12),
    st.lists(st.floats(0, 30, width=32), min_size=1, max_size=9).map(
        lambda ranges: np.array(ranges, np.float32)),
    st.floats(-3, 0), st.floats(0.01, 0.1), st.just(30.0), METRES, METRES)


def same(name, values):
    package, _, message = name.partition("/")
    assert data(make(name, values)) == ROS2.data(f"{package}/msg/{message}", theirs(name, values))


@given(robot=NAMES, laser=NAMES, pose=POSES, odometry=POSES, scan=SCANS,
       stamp_ns=st.integers(0, 2**31 * 10**9 - 1))
def test_what_a_robot_says_has_the_bytes_of_rosbags(robot, laser, pose, odometry, scan, stamp_ns):
    """rosbags serializes by the definitions of Humble that it brings along."""
    same("sensor_msgs/LaserScan", facade_messages.laser_scan(robot, laser, scan, stamp_ns))
    same("nav_msgs/Odometry", facade_messages.odometry(robot, pose, stamp_ns))
    for transform in (facade_messages.laser_transform(robot, laser, scan, stamp_ns),
                      facade_messages.odometry_transform(robot, pose, stamp_ns),
                      facade_messages.map_transform(robot, pose, odometry, stamp_ns)):
        same("geometry_msgs/TransformStamped", transform)
        listed = make("tf2_msgs/TFMessage", {"transforms": [
            make("geometry_msgs/TransformStamped", transform)]})
        assert data(listed) == ROS2.data("tf2_msgs/msg/TFMessage", theirs(
            "tf2_msgs/TFMessage", {"transforms": [transform]}))


@given(width=st.integers(1, 9), height=st.integers(1, 5), x_m=METRES, y_m=METRES,
       seed=st.integers(0, 99))
def test_so_has_its_map(width, height, x_m, y_m, seed):
    cells = np.random.default_rng(seed).choice([-1, 0, 100], (height, width)).astype(np.int8)
    same("nav_msgs/OccupancyGrid", facade_messages.occupancy_grid(
        GridSpec(0.2, width, height, x_m, y_m), cells, STAMP_NS))


@given(numbers=st.lists(METRES, min_size=7, max_size=7), frame=NAMES)
def test_so_have_commands_and_goals(numbers, frame):
    x, y, z, *turn = numbers
    same("geometry_msgs/Twist", {"linear": {"x": x, "y": y}, "angular": {"z": z}})
    same("geometry_msgs/PoseStamped", {
        "header": {"stamp": STAMP_NS, "frame_id": frame},
        "pose": {"position": {"x": x, "y": y, "z": z},
                 "orientation": dict(zip("xyzw", turn, strict=True))}})


@pytest.mark.parametrize("name", DEFINITIONS)
def test_types_have_the_names_and_fields_of_ros_2(name):
    package, _, message = name.partition("/")
    assert kind(name).__idl__.idl_transformed_typename == f"{package}::msg::dds_::{message}_"
    assert [field for field, _ in fields(name)] == [
        field for field, _ in ROS2.store.fielddefs[f"{package}/msg/{message}"][1]]
    assert data(kind(name).deserialize(data(make(name, {})))) == data(make(name, {}))
