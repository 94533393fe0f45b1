"""Strategies of search, coverage, formation and pursuit, with and without a network."""

import math

import numpy as np
import pytest
from benches import Team

from desim import ports
from desim.ports.pursuit import Caught, Pursuit, RobotSeen
from desim.ports.search import KnowVictim, Victim, VictimSearch
from desim.ports.tasks import Formation, SweepingTool
from desim.robot.coordination.strategies.evade import Evade
from desim.robot.coordination.strategies.leader_follower import LeaderFollower
from desim.robot.coordination.strategies.pursue import Pursue
from desim.robot.coordination.strategies.search_and_report import SearchAndReport
from desim.robot.coordination.strategies.spanning_tree_coverage import SpanningTreeCoverage
from desim.testing import check_strategy
from desim.units import NS_PER_S as S


@pytest.mark.parametrize("strategy", [SearchAndReport, SpanningTreeCoverage, LeaderFollower, Pursue,
                                      Evade])
def test_contract(strategy):
    check_strategy(strategy)


class Briefed(Team):
    """A team of one strategy that has a task."""

    def __init__(self, strategy, task, places, **params):
        super().__init__(lambda: strategy(strategy.Params(**params)), places, task=task)

    def see(self, name, content):
        """The task says ``content`` to ``name``."""
        self.strategies[name].on_task(self.benches[name], content)
        self.talk()


# ------------------------------------------------------------------------------------------- search


def searchers(**params):
    return Briefed(SearchAndReport, VictimSearch(3.0), {"one": (10.0, 0.0), "two": (0.0, 0.0),
                                                  "base": None}, **params)


def acts_of(team):
    return list(team.benches["base"].acts)


def test_the_base_confirms_once():
    team = searchers()
    team.see("one", Victim(3, ports.Place(12.0, 0.0)))
    team.wait(5)
    assert acts_of(team) == [KnowVictim(3)]


def test_a_teammate_carries_a_report_on():
    """The first robot is heard by the second alone, and the base, later, only by the second."""
    team = searchers(patience=None)
    team.deaf = {"base"}
    team.see("one", Victim(3, ports.Place(12.0, 0.0)))
    team.wait(2)
    team.deaf = {"one"}
    team.wait(2)
    assert acts_of(team) == [KnowVictim(3)]


def test_without_a_confirmation_it_goes_home_and_out_again():
    team = searchers(patience="10 s")
    team.know((30.0, 0.0))
    team.wait(1)
    team.deaf = {"one", "two", "base"}
    team.benches["one"].pose = ports.Pose2D(20.0, 0.0, 0.0)
    team.see("one", Victim(3, ports.Place(22.0, 0.0)))
    assert team.choose("one") == (30.0, 0.0)
    team.wait(9)
    assert team.benches["one"].goal == (30.0, 0.0)
    team.wait(1)
    assert team.benches["one"].goal == (10.0, 0.0)  # where it started
    team.drive("one")
    assert team.choose("one") == (30.0, 0.0)  # nobody has heard of it: it goes on
    team.wait(10)
    assert team.benches["one"].goal == (10.0, 0.0)
    team.deaf = set()
    team.wait(2)
    assert acts_of(team) == [KnowVictim(3)]
    assert team.benches["one"].goal == (30.0, 0.0)  # it was confirmed, and explores


# ----------------------------------------------------------------------------------------- coverage


def covered_by(team, most=20_000):
    """Robots drive until none has a place to go to; by name, the places they were at."""
    been = {name: [] for name in team.benches}
    for _ in range(most):
        moved = False
        for name, bench in team.benches.items():
            if bench.goal is None and team.choose(name) is None:
                continue
            team.drive(name)
            been[name].append(tuple(bench.pose[:2]))
            moved = True
        team.wait(1)
        if not moved:
            return been
    raise AssertionError("they drive for ever")


def sweepers(*deaf, **places):
    team = Briefed(SpanningTreeCoverage, SweepingTool(10.0), places or {"one": (-40.0, -40.0),
                                                                 "two": (40.0, 40.0)})
    team.deaf = set(deaf)
    return team


def cells(team):
    return team.strategies["one"]._covered.size


def test_one_robot_covers_all_cells():
    team = sweepers(one=(-40.0, -40.0))
    covered_by(team)
    assert cells(team) == 100 and team.strategies["one"]._covered.all()


def way_of_one():
    """The length of the way that one robot drives, and how many cells it is at twice."""
    team = sweepers(one=(-40.0, -40.0))
    been = [tuple(team.benches["one"].pose[:2]), *covered_by(team)["one"]]
    way_m = sum(math.dist(a, b) for a, b in zip(been, been[1:], strict=False))
    return way_m, len(been) - len(set(been))


def test_a_way_around_the_tree_is_as_long_as_it_has_cells():
    """Gabriely and Rimon 2001: each cell once, so n cells of width D in (n - 1) D, here with 5 m
    on the way to the first centre more or less."""
    way_m, twice = way_of_one()
    assert way_m == pytest.approx((100 - 1) * 10.0, abs=10.0) and twice <= 1


def test_a_way_from_row_to_row_is_longer(monkeypatch):
    """The twin: rows all from left to right."""
    monkeypatch.setattr(
        "desim.robot.coordination.sweep_tour.closed_tour",
        lambda blocks: [(row, column) for row in range(10) for column in range(10)])
    assert way_of_one()[0] > 1.5 * 990


def test_two_share_the_ground():
    alone = len(covered_by(sweepers(one=(-40.0, -40.0)))["one"])
    been = covered_by(sweepers())
    assert 0.35 * alone < len(been["one"]) < 0.65 * alone
    assert 0.35 * alone < len(been["two"]) < 0.65 * alone


def test_who_hears_nothing_covers_everything():
    alone = len(covered_by(sweepers(one=(-40.0, -40.0)))["one"])
    been = covered_by(sweepers("one", "two"))
    assert len(been["one"]) == alone and len(been["two"]) >= 0.9 * alone


# ---------------------------------------------------------------------------------------- formation

WEDGE = Formation("one", (ports.Place(50.0, 0.0),), {"two": (-2.0, 2.0)}, 0.5)


def following(seconds, speed_mps, cut_after=math.inf):
    """A leader drives east; a follower integrates its commands at 10 Hz. The distances from its
    place, once a second."""
    team = Briefed(LeaderFollower, WEDGE, {"one": (0.0, 0.0), "two": (-2.0, 2.0)})
    leader, follower = team.benches["one"], team.benches["two"]
    errors = []
    for tick in range(seconds * 10):
        team.deaf = {"one"} if tick >= cut_after * 10 else set()
        x_m, y_m, yaw = leader.pose
        leader.pose = ports.Pose2D(x_m + speed_mps * 0.1, y_m, yaw)
        for bench in (leader, follower):
            bench.now_ns += S // 10
            bench.run_timers()
            team.talk()
        if follower.driven:
            forward, _, turn = follower.driven[-1]
            x_m, y_m, yaw = follower.pose
            yaw += turn * 0.1
            follower.pose = ports.Pose2D(x_m + forward * math.cos(yaw) * 0.1,
                                         y_m + forward * math.sin(yaw) * 0.1, yaw)
        if tick % 10 == 9:
            errors.append(math.dist(follower.pose[:2], (leader.pose[0] - 2.0, 2.0)))
    return errors, follower


def test_a_follower_keeps_its_place():
    errors, _ = following(20, 0.5)
    assert errors[-1] < 0.1


def test_a_follower_that_hears_nothing_stands():
    errors, follower = following(20, 0.5, cut_after=10)
    assert follower.driven[-1] == [0.0, 0.0, 0.0]
    assert errors[-1] == pytest.approx(0.5 * 9, abs=0.3)  # it drove on for a second


# ------------------------------------------------------------------------------------------ pursuit

CHASE = Pursuit(("runner",), 8.0, 1.5)


def test_pursuers_report_what_they_see():
    team = Briefed(Pursue, CHASE, {"one": (0.0, 0.0), "two": (9.0, 0.0)})
    team.see("one", RobotSeen("runner", ports.Place(5.0, 0.0)))
    assert team.goals() == {"one": (5.0, 0.0), "two": (5.0, 0.0)}
    team.drive("two")  # nobody is there any more
    assert team.choose("two") not in (None, (5.0, 0.0))


def test_with_the_network_cut_each_hunts_alone():
    team = Briefed(Pursue, CHASE, {"one": (0.0, 0.0), "two": (9.0, 0.0)})
    team.deaf = {"two"}
    team.see("one", RobotSeen("runner", ports.Place(5.0, 0.0)))
    assert team.goals() == {"one": (5.0, 0.0), "two": None}


def test_the_caught_are_not_chased():
    team = Briefed(Pursue, CHASE, {"one": (0.0, 0.0)})
    team.see("one", Caught("runner"))
    team.see("one", RobotSeen("runner", ports.Place(5.0, 0.0)))
    assert team.goals() == {"one": None}


def test_an_evader_goes_where_pursuers_are_far():
    team = Briefed(Evade, CHASE, {"runner": (0.0, 0.0)})
    team.see("runner", RobotSeen("one", ports.Place(5.0, 0.0)))
    place = np.array(team.goals()["runner"])
    assert np.hypot(*(place - (5.0, 0.0))) > np.hypot(*place)
    assert place[0] < 0.0
