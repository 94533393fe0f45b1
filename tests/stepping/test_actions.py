"""A robot's actions while a run stands still: it drives, scans, shares its map."""

import math

import pytest
from runs import HELLO

from desim.errors import ModelError
from desim.stepping import ControlPeriods, Goals, Stepper, Turns
from desim.units import NS_PER_S

ON_REQUEST = "coordination.exchange.period=null"


def way_m(velocities, for_s=4, deployment="testbed"):
    """The way of robot_0 by its own pose, at these velocities, and its yaw at the end."""
    with Stepper(HELLO, ControlPeriods(NS_PER_S // 10),
                 overrides=[f"deployment={deployment}"]) as run:
        run.step_to(NS_PER_S)
        robot = run.robots["robot_0"]
        before = robot.pose
        while (turn := run.next_decision(run.now_ns + for_s * NS_PER_S)) is not None:
            if turn.robot == "robot_0" and velocities is not None:
                turn.context.drive(*velocities)
            if run.now_ns > (1 + for_s) * NS_PER_S:
                break
        return math.dist(before[:2], robot.pose[:2]), robot.pose.yaw_rad


@pytest.mark.parametrize("deployment", ["testbed", "field"])
def test_a_robot_drives_as_it_is_commanded(deployment):
    way, _ = way_m((0.3, 0.0, 0.0), deployment=deployment)
    assert 1.0 < way < 1.2
    assert way_m((0.0, 0.0, 0.5), deployment=deployment) == (0.0, pytest.approx(1.8, abs=0.3))


def test_a_robot_without_commands_stands():
    assert way_m(None) == (0.0, 0.0)


def test_a_command_times_out():
    with Stepper(HELLO, ControlPeriods(NS_PER_S)) as run:
        run.step_to(NS_PER_S)
        robot = run.robots["robot_0"]
        robot.drive(0.5, 0.0, 0.0)
        run.step_to(4 * NS_PER_S)
        stood = robot.pose
        run.step_to(6 * NS_PER_S)
        assert robot.pose == stood


def test_to_drive_is_to_give_the_goal_up():
    with Stepper(HELLO, Turns(10 * NS_PER_S)) as run:
        run.step_to(4 * NS_PER_S)
        robot = run.robots["robot_0"]
        assert robot.goal is not None
        robot.drive(0.0, 0.0, 0.5)
        assert robot.goal is None


@pytest.mark.parametrize("velocities", [(math.nan, 0, 0), (0, math.inf, 0), ("1", 0, 0)])
def test_velocities_are_finite(velocities):
    with Stepper(HELLO) as run, pytest.raises(ModelError, match="drives at three finite veloc"):
        run.robots["robot_0"].drive(*velocities)


def test_the_newest_scan_is_there():
    with Stepper(HELLO) as run:
        robot = run.robots["robot_0"]
        assert robot.scan() is None
        run.step_to(NS_PER_S)
        scan = robot.scan()
        assert scan.ranges.max() <= scan.range_max_m
        assert not scan.ranges.flags.writeable
        assert run.now_ns - scan.stamp_ns < NS_PER_S // 5


def known_by_others(shares):
    """The areas that robot_1 has of robot_0 when that has shared its map at these seconds."""
    with Stepper(HELLO, overrides=[ON_REQUEST, "stop.elapsed=20 s"]) as run:
        areas = []
        for second in range(1, 9):
            run.step_to(second * NS_PER_S)
            if second in shares:
                run.robots["robot_0"].share_map()
            areas.append(run.robots["robot_1"].areas().get("robot_0"))
        return [0 if area is None else int(area.seen.sum()) for area in areas]


def test_a_map_is_shared_when_its_robot_wants_to():
    assert known_by_others([]) == [0] * 8
    once, twice = known_by_others([3]), known_by_others([3, 6])
    assert once[:3] == [0] * 3 and once[4] > 0 and once[4:] == once[4:5] * 4
    assert twice[:6] == once[:6] and twice[7] > once[7]


def test_who_shares_in_no_such_way_says_so():
    for exchange, said in (("null", "shares nothing"), ("{model: submaps}", "Submaps")):
        with Stepper(HELLO, overrides=[f"coordination.exchange={exchange}"]) as run, \
                pytest.raises(ModelError, match=said):
            run.robots["robot_0"].share_map()


def test_the_known_area_is_that_of_the_map():
    with Stepper(HELLO, Goals()) as run:
        run.step_to(5 * NS_PER_S)
        robot = run.robots["robot_0"]
        cells = (robot.occupancy() >= 0).sum()
        assert robot.known_m2() == pytest.approx(cells * robot.grid.resolution_m**2)
        assert cells > 1000
