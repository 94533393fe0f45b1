"""Memories of a robot: goals given up, places visited, its last contact, its meetings."""

import math

import numpy as np
import pytest

from desim.ports import Mark, Place, Pose2D, TeamLink
from desim.robot.coordination.assignment import finite_costs_m
from desim.robot.coordination.blacklist import Blacklist
from desim.robot.coordination.contact import Contact
from desim.robot.coordination.meeting import Meeting, drive_near, is_near, silent
from desim.robot.coordination.visits import Visits
from desim.scenario.schema.robot import ExplorationParams
from desim.testing import StrategyBench

S = 10**9


def bench(now_s=0, pose=(0.0, 0.0), heard=None):
    made = StrategyBench([], "a", ("b", "c"))
    made.now_ns = now_s * S
    made.pose = None if pose is None else Pose2D(*pose, 0.0)
    made.heard = {name: TeamLink(heard_ns) for name, heard_ns in (heard or {}).items()}
    return made


def test_a_goal_given_up_is_avoided_for_its_time():
    avoided = Blacklist(ExplorationParams(blacklist_radius="1 m", blacklist_for="10 s"), 100, 0.2)
    avoided.add(40 * 100 + 50, 5 * S)
    avoided.add(7, 6 * S)
    assert not avoided.has_expired(15 * S - 1) and avoided.has_expired(15 * S)
    avoided.expire(15 * S - 1)
    assert avoided.discs().tolist() == [[40, 50, 25], [0, 7, 25]]
    avoided.expire(15 * S)
    assert avoided.discs().tolist() == [[0, 7, 25]] and not avoided.has_expired(15 * S)
    avoided.expire(16 * S)
    assert avoided.discs().shape == (0, 3)


def test_two_visits_to_one_place_are_enough():
    visits = Visits(0.5)
    assert not visits.were_fruitless(1.0, 1.0)
    visits.add(1.0, 1.0)
    assert not visits.were_fruitless(1.0, 1.0)
    visits.add(1.0, 1.5)
    assert visits.were_fruitless(1.5, 1.5) and not visits.were_fruitless(1.0, 2.01)
    visits.add(3.0, 1.0)  # elsewhere: counted anew
    assert not visits.were_fruitless(3.0, 1.0)


def test_silence_counts_from_the_last_word_or_else_from_the_first_question():
    contact = Contact()
    assert contact.silent_ns(bench(3)) == 0
    assert contact.silent_ns(bench(7)) == 4 * S and contact.place is None
    assert contact.silent_ns(bench(9, (1.0, 2.0), {"b": 8 * S, "c": 6 * S})) == S
    assert contact.place == Place(1.0, 2.0)
    assert contact.silent_ns(bench(12, (5.0, 5.0), {"b": 8 * S}), ["b"]) == 4 * S
    assert contact.place == Place(1.0, 2.0)  # nobody was heard since
    assert contact.silent_ns(bench(12, (5.0, 5.0), {"b": 8 * S}), ["c"]) == 9 * S


def test_a_word_at_the_start_of_a_run_is_one():
    contact = Contact()
    assert contact.silent_ns(bench(5, (1.0, 1.0), {"b": 0})) == 5 * S
    assert contact.place == Place(1.0, 1.0)


def test_who_was_not_heard_within_a_time_is_silent():
    robot = bench(10, heard={"b": 4 * S, "c": 4 * S - 1})
    assert silent(robot, ["b", "c", "d"], 6 * S) == ["c", "d"]


@pytest.mark.parametrize("place, near", [((3.0, 4.0), True), ((3.0, 4.01), False)])
def test_near_is_within_a_distance(place, near):
    assert is_near(bench(), Place(*place), 5.0) == near
    assert not is_near(bench(pose=None), Place(*place), 5.0)


def test_a_robot_leaves_for_a_meeting_so_that_it_comes_in_time():
    robot = bench(10)
    robot.path_lengths_m = lambda places, origin=None: np.array([6.0])
    assert [Meeting(Place(6.0, 0.0), s * S).is_due(robot, 0.5) for s in (21, 22, 23)] == [
        True, True, False]
    robot.path_lengths_m = lambda places, origin=None: np.array([math.inf])
    assert not Meeting(Place(6.0, 0.0), 11 * S).is_due(robot, 0.5)


def test_a_meeting_is_shown_with_its_place_and_time():
    robot, shown = bench(), []
    robot.show = lambda name, marks: shown.append((name, marks))
    meeting = Meeting(Place(1.0, 2.0), 30 * S)
    assert meeting.shown(robot) is meeting
    assert shown == [("meeting", [Mark(1.0, 2.0, "a meets at 30 s")])]


class Driver:
    """A robot at the origin that notes what it is asked to do."""

    pose = Pose2D(0.0, 0.0, 0.0)

    def __init__(self, goal):
        self.goal, self.done = goal, []

    def stop(self):
        self.done.append("stop")

    def go(self, place):
        self.done.append(place)


THERE = Place(9.0, 0.0)


@pytest.mark.parametrize("near_m, goal, done", [
    (5.0, None, [THERE]), (5.0, THERE, []), (5.0, Place(1.0, 1.0), [THERE]),
    (9.0, THERE, ["stop"]), (9.0, None, [])])
def test_a_robot_drives_until_it_is_near(near_m, goal, done):
    robot = Driver(goal)
    drive_near(robot, THERE, near_m)
    assert robot.done == done


def test_no_way_costs_more_than_any_way():
    assert finite_costs_m([[1.0, math.inf], [2e5, 3.0]]).tolist() == [[1.0, 1e6], [2e5, 3.0]]
