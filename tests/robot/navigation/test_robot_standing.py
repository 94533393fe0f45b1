"""A robot that stands: for how long, who says so, and what it tries from goal to goal."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from runs import HELLO, built, finished

from desim.monitor.meters.meter import Second
from desim.monitor.meters.stood import LongestStands
from desim.monitor.summary import summarize
from desim.robot.navigation.patience import ProgressPatience
from desim.robot.navigation.recovery import Recovery
from desim.robot.navigation.standing import GAP_NS, PLACE_M, Standing
from desim.scenario.schema.navigation import NavigationConstants

S = 10**9


def test_it_stands_from_its_first_instant_at_a_place():
    standing = Standing()
    assert [standing.note(k * S, x, 0.0) for k, x in enumerate((3.0, 3.2, 3.4, 3.6, 3.6))] \
        == [0, S, 2 * S, 0, S]


def test_a_pause_between_goals_ends_it():
    standing = Standing()
    standing.note(0, 0.0, 0.0)
    assert standing.note(GAP_NS, 0.0, 0.0) == GAP_NS
    assert standing.note(2 * GAP_NS + 1, 0.0, 0.0) == 0


@given(st.lists(st.floats(-0.4, 0.4), min_size=1, max_size=40))
def test_small_motions_about_a_place_are_no_driving(places):
    standing = Standing()
    standing.note(0, 0.0, 0.0)
    for k, x in enumerate(places, 1):
        assert abs(x) <= PLACE_M and standing.note(k * S, x, 0.0) == k * S


def test_the_longest_stand_of_those_with_goals_counts():
    meter = LongestStands(("a", "b"))
    meter.listeners["goal"]("a", 0, 0, 0)
    for k in range(31):
        meter.each_second(Second(k * S, np.array(((0.0, 0.0, 0.1 * k), (0.1 * k, 0.0, 0.0))),
                                 np.zeros(2), None))
    assert meter.summary(0) == {"stood_s": 30.0}
    assert meter.by_host(0) == {"a": {"stood_s": 30.0}, "b": {"stood_s": 0.0}}


def test_recoveries_go_on_from_goal_to_goal_where_a_robot_has_stood():
    patience = ProgressPatience(NavigationConstants())
    tried = []
    for stood_s in (0, 12, 18, 3):
        patience.begin_goal(0, stood_s * S)
        tried.append(patience.next())
    assert tried == [Recovery.REPLAN, Recovery.ROTATE, Recovery.RETREAT, Recovery.REPLAN]


@pytest.mark.parametrize("overrides, says", [
    (("fleet.types.pioneer3dx.max_speed=0.01 m/s",), True), ((), False)])
def test_a_robot_that_stands_says_so(overrides, says):
    simulation = built(HELLO, "stop.elapsed=40 s", "stop.explored=100 %", *overrides)
    said = []
    simulation.graph.listeners["stands"] = lambda *row: said.append(row[0])
    finished(simulation)
    stood_s = summarize(simulation.monitor, simulation.kernel.now_ns)["stood_s"]
    assert bool(said) == says == (stood_s >= 20.0)
