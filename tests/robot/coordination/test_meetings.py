"""Robots meet where and when they agreed: rendezvous of a team, of an explorer and its relay."""

import pytest
from benches import Team

from desim import ports
from desim.robot.coordination.meeting import Meeting, drive_near, silent
from desim.robot.coordination.strategies.rendezvous import Rendezvous
from desim.robot.coordination.strategies.role_based import RoleBased
from desim.testing import StrategyBench, check_strategy
from desim.units import NS_PER_S

FAR = (-40, 0), (0, 30), (40, 0)


def play(team, seconds, *, drives=True):
    """Time passes; who hears whom is up to ``team.deaf``; who has a goal is there a second later.
    """
    for _ in range(seconds):
        team.meet()
        team.wait()
        for name, bench in team.benches.items():
            if drives and bench.goal is not None:
                team.drive(name)


def rendezvous(**params):
    robots = {f"r{k}": (k, 0) for k in range(3)}
    team = Team(lambda: Rendezvous(Rendezvous.Params(**params)), robots, FAR)
    play(team, 1)
    return team


def test_meetings_keep_the_contract():
    for cls in (Rendezvous, RoleBased):
        check_strategy(cls)
        check_strategy(cls, interval="1 s", failsafe_after="0 s", linger="0 s")


def test_a_meeting_is_due_when_the_way_takes_the_time_that_is_left():
    robot = StrategyBench([])
    meeting = Meeting(ports.Place(30.0, 0.0), robot.now_ns + 50 * NS_PER_S)
    assert not meeting.is_due(robot, 0.7)  # 43 s
    assert meeting.is_due(robot, 0.6)  # 50 s


def test_a_robot_stands_when_it_is_near():
    robot = StrategyBench([])
    drive_near(robot, ports.Place(6.0, 0.0), 5.0)
    assert robot.goal == (6.0, 0.0)
    robot.pose = ports.Pose2D(1.5, 0.0, 0.0)
    drive_near(robot, ports.Place(6.0, 0.0), 5.0)
    assert robot.goal is None


def test_silent_are_those_not_heard_lately():
    robot = StrategyBench([])  # robot_2 was heard a second ago
    assert silent(robot, robot.team, NS_PER_S) == ["robot_10", "base"]
    assert silent(robot, robot.team, NS_PER_S - 1) == ["robot_2", "robot_10", "base"]


def test_who_hears_everybody_agrees_without_driving():
    team = rendezvous(interval="10 s")
    play(team, 11)
    assert [(source, topic) for source, topic, _ in team.sent] == [("r0", "meeting")]
    # (0, 30) has the shortest ways to both others.
    assert team.sent[0][2][:2] == [0.0, 30.0]
    assert team.goals() == dict.fromkeys(team.benches)
    assert team.choose("r2") is not None  # they explore


def test_a_team_that_is_apart_meets_and_parts():
    team = rendezvous(interval="60 s", linger="3 s")
    for k, bench in enumerate(team.benches.values()):
        bench.pose = ports.Pose2D(30.0 * (k - 1), 0.0, 0.0)  # 50 s from the start, 0 s, 50 s
    team.deaf = set(team.benches)
    play(team, 20, drives=False)
    assert [bench.goal for bench in team.benches.values()] == [(0.0, 0.0), None, (2.0, 0.0)]
    assert team.choose("r0") is None
    assert team.choose("r1") is not None  # there is time
    team.benches["r1"].goal = None
    play(team, 3)
    team.deaf = set()
    play(team, 50)
    assert [topic for _, topic, _ in team.sent] == ["meeting"]


def test_who_waits_wasted_goes_on_alone_and_comes_back_after_twice_the_time():
    team = rendezvous(interval="20 s", failsafe_after="5 s")
    team.deaf = set(team.benches)
    play(team, 22, drives=False)
    assert team.choose("r0") is None
    play(team, 5, drives=False)
    assert team.choose("r0") == (0.0, 30.0)
    team.drive("r0")
    play(team, 8)  # at 34 s; the next is at 60 s, and the way takes 50 s
    assert team.benches["r0"].pose[:2] == (0.0, 0.0)


def test_who_misses_two_meetings_is_expected_no_more_until_heard():
    team = rendezvous(interval="10 s", failsafe_after="1 s")
    team.deaf = {"r2"}
    play(team, 33)  # missed at 10 s, and at 30 s
    assert not team.sent
    play(team, 40)  # at 70 s the two are a team
    assert {source for source, *_ in team.sent} == {"r0", "r2"}  # and who is alone, with itself
    team.deaf = set()
    play(team, 1)
    assert team.strategies["r0"]._missing(team.benches["r0"]) == []


def pair(base=False, **params):
    robots = {"r0": (0, 0), "r1": (2, 0), **({"base": None} if base else {})}
    team = Team(lambda: RoleBased(RoleBased.Params(**params)), robots, FAR)
    play(team, 1)
    return team


def test_the_explorer_explores_and_the_relay_does_not():
    team = pair()
    assert team.choose("r0") is not None
    assert team.choose("r1") is None


def test_the_last_of_an_odd_fleet_explores():
    team = Team(lambda: RoleBased(RoleBased.Params()), {f"r{k}": (k, 0) for k in range(3)}, FAR)
    play(team, 1)
    assert team.choose("r2") is not None


def agreed(team):
    return [content for _, topic, content in team.sent if topic == "meeting"]


def test_they_agree_on_the_next_goal_when_the_relay_can_have_been_home():
    team = pair(interval="10 s", linger="2 s")
    play(team, 14, drives=False)
    meeting, = agreed(team)
    assert (meeting["with"], meeting["at"]) == ("r1", [0.0, 30.0])
    assert (meeting["time_ns"] - team.benches["r0"].now_ns) / NS_PER_S == pytest.approx(100, abs=3)
    play(team, 3)  # the relay was home at once
    assert team.benches["r1"].pose[:2] == (0.0, 30.0)


def test_a_relay_with_a_base_goes_home_until_it_hears_it():
    team = pair(base=True, interval="10 s", linger="2 s")
    team.deaf = {"base"}
    team.benches["r1"].pose = ports.Pose2D(50.0, 0.0, 0.0)
    play(team, 14, drives=False)
    assert team.benches["r1"].goal == (2.0, 0.0)
    team.deaf = set()
    play(team, 2, drives=False)
    assert team.benches["r1"].goal == (0.0, 30.0)
    assert {topic for source, topic, _ in team.sent if source == "base"} == {"here"}


def test_partners_that_wait_wasted_explore_until_they_hear_each_other():
    team = pair(interval="10 s", failsafe_after="5 s", linger="2 s")
    team.deaf = {"r0", "r1"}
    play(team, 14, drives=False)
    assert (team.choose("r0"), team.choose("r1")) == (None, None)
    play(team, 4, drives=False)
    assert team.goals()["r1"] is not None
    assert None not in (team.choose("r0"), team.choose("r1"))
    team.deaf = set()
    play(team, 4, drives=False)
    assert agreed(team)
    assert team.choose("r1") is None
