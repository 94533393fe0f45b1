"""Regulated pure pursuit: its formulas by hand, the arc that it drives, and where it stops."""

import math

import numpy as np
import pytest
from drawn import Drawn, costmap
from hypothesis import given
from hypothesis import strategies as st

from desim.middleware.contents import LaserScan
from desim.robot.mapping.tiles import FREE
from desim.robot.navigation.global_costmap import inflated_cost
from desim.robot.navigation.local_planners import regulated_pure_pursuit
from desim.robot.navigation.local_planners.regulated_pure_pursuit import (
    RegulatedPurePursuit,
    slower_at_goal,
    slower_by_cost,
    slower_in_curves,
)
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.navigation import Navigation
from desim.testing.local_planner_bench import LocalPlannerBench

BODY = BodyType()  # a disc of 0.26 m, 1.2 m/s


def bench(way, walls=(), body=BODY, **params):
    """At (20, 20) on an open floor, heading along x; ``walls``: (angle, range) of returns."""
    made = LocalPlannerBench(
        RegulatedPurePursuit(RegulatedPurePursuit.Params(**params)), Navigation(), body,
        costmap(Drawn(np.full((200, 200), FREE, np.int16)), body.inscribed_radius_m))
    made.follow(np.add(way, (20.0, 20.0)))
    ranges = np.full(361, 26.0, np.float32)
    for angle, r in walls:
        ranges[round(math.degrees(angle)) + 180] = r
    made.costmap.observe([(LaserScan(0, ranges, -math.pi, math.pi / 180, 26.0),
                           (20.0, 20.0, 0.0))])
    return made


def test_the_speed_in_a_curve():
    """curvatureConstraint: v (1 - |r - r_min| / r_min) = v r / r_min, with r_min = 0.9 m."""
    assert slower_in_curves(1.2, 0.0, 0.9) == 1.2
    assert slower_in_curves(1.2, 1.0 / 0.9, 0.9) == pytest.approx(1.2)
    assert slower_in_curves(1.2, -2.0, 0.9) == pytest.approx(1.2 * 0.5 / 0.9)
    assert slower_in_curves(1.2, 1.0, 0.9) == 1.2, "1 m is wide enough"


def test_the_speed_near_an_obstacle():
    """costConstraint: d = (k r - ln cost + ln 253) / k; below 0.6 m the speed is v gain d / 0.6.
    With k = 10 / m and r = 0.26 m, cost 253 is d = 0.26 m, and 34 is 0.26 + ln(253 / 34) / 10."""
    assert slower_by_cost(1.2, 0, 0.26, 10.0, 0.6, 1.0) == 1.2
    assert slower_by_cost(1.2, 253, 0.26, 10.0, 0.6, 1.0) == pytest.approx(1.2 * 0.26 / 0.6)
    assert slower_by_cost(1.2, 34, 0.26, 10.0, 0.6, 1.0) == pytest.approx(1.2 * 0.4607 / 0.6,
                                                                         rel=1e-3)
    assert slower_by_cost(1.2, 34, 0.26, 10.0, 0.6, 0.5) == pytest.approx(0.6 * 0.4607 / 0.6,
                                                                         rel=1e-3)


@given(st.floats(0.27, 0.55))
def test_the_distance_comes_back_from_the_cost(distance_m):
    cost = inflated_cost(distance_m, 0.26, 10.0)
    found = slower_by_cost(1.0, cost, 0.26, 10.0, 1.0, 1.0)
    assert found == pytest.approx(distance_m, abs=0.1 / cost + 0.001)


def test_the_speed_at_the_goal():
    """approachVelocityConstraint: v d / 0.6 where less than 0.6 m of path are left, >= 0.05 m/s."""
    assert slower_at_goal(1.2, 0.7, 0.7, 0.6, 0.05) == 1.2
    assert slower_at_goal(1.2, 0.5, 0.3, 0.6, 0.05) == pytest.approx(0.6)
    assert slower_at_goal(1.2, 0.5, 0.01, 0.6, 0.05) == 0.05
    assert slower_at_goal(0.04, 0.5, 0.01, 0.6, 0.05) == 0.04, "never faster than it was"


def test_the_arc_goes_through_the_carrot():
    """The carrot at 0.6 m along a path at 30 degrees: (0.52, 0.3), curvature 2 * 0.3 / 0.36. The
    speed is 1.2 * (0.6 / 0.9) in a curve of radius 0.6 m."""
    way = [(0.0, 0.0), (3.0 * math.cos(math.pi / 6), 1.5)]
    v, w, togo = bench(way).steer(20.0, 20.0, 0.0)
    assert v == pytest.approx(1.2 * 0.6 / 0.9)
    assert w == pytest.approx(v * 0.6 / 0.36)
    assert togo == pytest.approx(3.0)


def test_a_lookahead_by_speed_stays_between_its_bounds():
    """1.5 s at 0.4 m/s: 0.6 m; at 1.2 m/s 0.9 m, not 1.8; standing 0.3 m."""
    for speed_mps, carrot_m in ((0.4, 0.6), (1.2, 0.9), (0.0, 0.3)):
        made = bench([(0.0, 0.0), (3.0, 1.0)], scaled_lookahead=True)
        made.speed_mps = speed_mps
        v, w, _ = made.steer(20.0, 20.0, 0.0)
        left_m = carrot_m / math.sqrt(10.0)
        assert w / v == pytest.approx(2.0 * left_m / carrot_m**2)


def test_it_turns_on_the_spot_first():
    """The way is 90 degrees to the left: 1.8 rad/s, as far as 3.2 rad/s^2 get in 0.1 s."""
    made = bench([(0.0, 0.0), (0.0, 3.0)])
    assert made.steer(20.0, 20.0, 0.0)[:2] == (0.0, pytest.approx(0.32))
    made.turn_radps = 1.7
    assert made.steer(20.0, 20.0, 0.0)[:2] == (0.0, pytest.approx(1.8))


def test_a_turn_ends_in_time():
    """0.8 rad are left, a little more than the angle that starts a turn: sqrt(2 * 3.2 * 0.8) is
    more than 1.8 rad/s, but not with a tenth of the acceleration."""
    slow = BodyType(turn_acceleration="0.32 rad/s^2")
    made = bench([(0.0, 0.0), (3 * math.cos(0.8), 3 * math.sin(0.8))], body=slow)
    made.turn_radps = 1.8
    assert made.steer(20.0, 20.0, 0.0)[1] == pytest.approx(math.sqrt(2 * 0.32 * 0.8))


def test_it_stops_for_what_is_on_its_arc_and_says_so():
    made = bench([(0.0, 0.0), (3.0, 0.0)], [(0.0, 0.7)])
    assert made.steer(20.0, 20.0, 0.0) == (0.0, 0.0, pytest.approx(3.0))
    assert made.is_blocked
    beside = bench([(0.0, 0.0), (3.0, 0.0)], [(0.8, 0.6)])
    assert beside.steer(20.0, 20.0, 0.0)[0] > 0.0 and not beside.is_blocked


def test_what_is_beyond_the_carrot_does_not_stop_it():
    far = bench([(0.0, 0.0), (3.0, 0.0)], [(0.0, 1.0)])
    assert far.steer(20.0, 20.0, 0.0)[0] > 0.0


def test_a_wrong_constant_is_noticed(monkeypatch):
    """The twin: with equation 5 by the square of the radius the arc's speed is another."""
    monkeypatch.setattr(regulated_pure_pursuit, "slower_in_curves",
                        lambda v, k, r: v * min(1.0, 1.0 / (abs(k) * r)**2))
    with pytest.raises(AssertionError):
        test_the_arc_goes_through_the_carrot()
