"""The teammates of a host: whose pose counts, and who is there."""

import math

import numpy as np
import pytest

from desim.middleware.contents import LaserScan, Pose
from desim.ports import Peer, Place
from desim.robot.stamped_poses import between, laser_at, step
from desim.robot.team import Team

S = 10**9


def test_the_newest_pose_counts_and_an_older_one_says_that_somebody_is_there():
    team = Team(("a", "b"), 10 * S)
    team.note_pose("a", 1.0, 2.0, 0.5, 5 * S, 6 * S)
    team.note_goal("a", Place(9.0, 9.0))
    team.note_pose("a", 3.0, 4.0, 0.0, 4 * S, 7 * S)  # overtaken on its way
    assert team.peers == {"a": Peer(1.0, 2.0, 0.5, 7 * S, Place(9.0, 9.0))}
    team.note_pose("a", 3.0, 4.0, 0.0, 5 * S, 8 * S)  # of the same instant: the last one
    assert team.peers == {"a": Peer(3.0, 4.0, 0.0, 8 * S, Place(9.0, 9.0))}


def test_who_is_silent_for_longer_than_agreed_counts_as_lost():
    team = Team(("a", "b"), 10 * S)
    assert team.changes(0) == []
    team.spoke("b", 0)
    assert team.changes(0) == [("b", True)]
    assert team.changes(10 * S) == []
    assert team.changes(10 * S + 1) == [("b", False)]
    assert team.changes(30 * S) == []
    team.note_pose("b", 0.0, 0.0, 0.0, 0, 31 * S)
    assert team.changes(31 * S) == [("b", True)]


def test_a_link_is_as_old_as_the_last_message_of_any_kind():
    team = Team(("a", "b", "c"), 10 * S, lambda message: lambda: -60.0)
    team.spoke("a", 3)
    team.note_pose("a", 0.0, 0.0, 0.0, 0, 2)
    team.note_pose("b", 0.0, 0.0, 0.0, 0, 5)
    links = team.links()
    assert {name: link.heard_ns for name, link in links.items()} == {"a": 3, "b": 5}
    assert links["a"].signal_dbm is None  # none of its messages was received


def test_between_two_poses_a_robot_turns_the_shorter_way():
    before, after = Pose(10, 0.0, 4.0, 3.0), Pose(20, 1.0, 2.0, -3.0)
    there = between(before, after, 15)
    assert (there.stamp_ns, there.x_m, there.y_m) == (15, 0.5, 3.0)
    assert abs(there.yaw_rad) == pytest.approx(math.pi)
    assert step(before, after) == pytest.approx((math.sqrt(5), math.tau - 6.0))


def test_a_laser_turns_with_its_robot():
    for mount, place in (((0.5, 0.25), (0.75, 2.5)), ((0.0, 0.25), (0.75, 2.0)),
                         ((0.5, 0.0), (1.0, 2.5)), ((0.0, 0.0), (1.0, 2.0))):
        scan = LaserScan(0, np.zeros(1, np.float32), 0.0, 0.1, 8.0, *mount)
        assert laser_at(1.0, 2.0, math.pi / 2, scan) == pytest.approx(place)
