"""The messages of a robot about itself, and its frames."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.loop import facade_messages
from desim.middleware.contents import LaserScan, Pose
from desim.ports import GridSpec, Pose2D
from desim.robot.transforms import moved

METRES, ANGLES = st.floats(-100, 100), st.floats(-3, 3)
POSES = st.builds(Pose, st.just(5), METRES, METRES, ANGLES)


def link(transform):
    """The frames that a transform joins, and the pose of the second in the first."""
    shift, turn = transform["transform"]["translation"], transform["transform"]["rotation"]
    return ((transform["header"]["frame_id"], transform["child_frame_id"]),
            Pose2D(shift["x"], shift["y"], 2 * math.atan2(turn["z"], turn["w"])))


@given(pose=POSES, odometry=POSES)
def test_the_frames_lead_from_the_map_to_where_the_robot_is(pose, odometry):
    above, placed = link(facade_messages.map_transform("r", pose, odometry, 7))
    below, driven = link(facade_messages.odometry_transform("r", odometry, 7))
    assert above == ("map", "r/odom") and below == ("r/odom", "r/base_link")
    x_m, y_m, yaw_rad = moved(placed, driven)
    assert (x_m, y_m) == pytest.approx((pose.x_m, pose.y_m), abs=1e-9)
    assert math.remainder(yaw_rad - pose.yaw_rad, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_an_offset_the_other_way_round_would_be_seen():
    """The twin: odometry as seen from the pose leads elsewhere."""
    pose, odometry = Pose(5, 1.0, 0.0, math.pi / 2), Pose(5, 0.0, 2.0, 0.0)
    _, placed = link(facade_messages.map_transform("r", odometry, pose, 7))
    _, driven = link(facade_messages.odometry_transform("r", odometry, 7))
    assert moved(placed, driven)[:2] != pytest.approx(pose[1:3])


def test_a_scan_names_its_laser_and_its_last_angle():
    scan = LaserScan(5, np.array([1.0, 2.5, 30.0], np.float32), -0.5, 0.5, 30.0, 0.2, -0.1)
    said = facade_messages.laser_scan("robot_3", "scan", scan, 7)
    assert said == {"header": {"stamp": 7, "frame_id": "robot_3/scan"}, "angle_min": -0.5,
                    "angle_max": 0.5, "angle_increment": 0.5, "range_max": 30.0,
                    "ranges": [1.0, 2.5, 30.0]}
    assert link(facade_messages.laser_transform("robot_3", "scan", scan, 7)) == (
        ("robot_3/base_link", "robot_3/scan"), (0.2, -0.1, 0.0))


def test_a_map_begins_at_its_lower_left_cell():
    said = facade_messages.occupancy_grid(GridSpec(0.5, 3, 2, -1.0, 4.0), np.array(
        [[0, 100, -1], [-1, -1, 0]], np.int8), 7)
    assert said["data"] == [0, 100, -1, -1, -1, 0]
    assert said["header"] == {"stamp": 7, "frame_id": "map"}
    info = said["info"]
    assert (info["resolution"], info["width"], info["height"]) == (0.5, 3, 2)
    assert info["origin"]["position"] == {"x": -1.0, "y": 4.0}
