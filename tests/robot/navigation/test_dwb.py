"""DWB: critics' scores against a table worked out by hand, samples, and the sign that may not flip.

The table is of Nav2's formulas (navigation2, dwb_critics and dwb_plugins, read at commit a3a97043).
A robot stands at (20, 20) and heads along x; the path leads 2 m straight on; cells are 0.1 m wide
and 60 x 60, the robot in the corner of cells 29 and 30. So (x, y) from the robot is in column 30 +
floor(x / 0.1), and row likewise. The rollout takes 1 s with unlimited acceleration.
"""

import math

import numpy as np
import pytest
from drawn import Drawn, costmap
from hypothesis import given
from hypothesis import strategies as st

from desim.middleware.contents import LaserScan
from desim.robot.mapping.tiles import FREE
from desim.robot.navigation.dwb.oscillation import Oscillation
from desim.robot.navigation.dwb.velocity_samples import resampled, samples
from desim.robot.navigation.kernels import dwb as kernels
from desim.robot.navigation.local_planners import dwb
from desim.robot.navigation.local_planners.dwb import Dwb
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.navigation import Navigation
from desim.testing.local_planner_bench import LocalPlannerBench

SWIFT = BodyType(acceleration="10000 m/s^2", turn_acceleration="10000 rad/s^2")
STRAIGHT = [(0.05, 0.05), (2.05, 0.05)]


def bench(way, returns=(), body=SWIFT, **params):
    """At (20, 20), heading along x; ``returns``: (x, y) seen from there."""
    made = LocalPlannerBench(Dwb(Dwb.Params(**{"sim_time": "1 s", **params})), Navigation(), body,
                             costmap(Drawn(np.full((200, 200), FREE, np.int16))))
    made.follow(np.add(way, (20.0, 20.0)))
    made.position = 20.0, 20.0, 0.0
    ranges = np.full(721, 26.0, np.float32)
    for x, y in returns:
        ranges[round(math.degrees(2 * math.atan2(y, x))) + 360] = math.hypot(x, y)
    made.costmap.observe([(LaserScan(0, ranges, -math.pi, math.pi / 360, 26.0),
                           (20.0, 20.0, 0.0))])
    return made


def rated(made, *velocities):
    rest = made.rest()
    togo_m = float(np.hypot(*np.diff(rest, axis=0).T).sum())
    return made.planner.rated(made, rest, togo_m, np.array(velocities))


# RotateToGoal, BaseObstacle, GoalAlign, PathAlign, PathDist, GoalDist of each velocity.
# The path runs through row 30 from column 30 to 50. adjustPlanResolution puts int(1.8 / 0.1) - 1 =
# 17 steps of 2 / 17 = 0.1176 m on it, which leave out columns 33, 40 and 47. The goal's cell is
# (50, 30); GoalAlign moves the goal on by 0.1 m, away from the robot, to (2.15, 0.0524): (51, 30).
TABLE = {
    # Ends at (1.03, 0), (40, 30): 10 from the goal, 1 from the path's column 39. Its nose at
    # (1.13, 0) is in (41, 30): 10 from (51, 30).
    (1.03, 0.0): (0.0, 0.0, 10.0, 0.0, 1.0, 10.0),
    # Slower: (0.53, 0) is in (35, 30); the nose at 0.63 in (36, 30).
    (0.53, 0.0): (0.0, 0.0, 15.0, 0.0, 0.0, 15.0),
    # On the spot by 0.5 rad: (30, 30). The nose at (0.1 cos 0.5, 0.1 sin 0.5) = (0.088, 0.048) is
    # there, too: 21 from (51, 30).
    (0.0, 0.5): (0.0, 0.0, 21.0, 0.0, 0.0, 20.0),
    # 1.03 m/s and 1 rad/s, in 40 Euler steps of 1/40 s and 1/40 rad, each with the heading before
    # it. The sums of cos(k / 40) and sin(k / 40) over k = 0..39 are 33.887 and 17.966: it ends at
    # 0.02575 (33.887, 17.966) = (0.8726, 0.4626), cell (38, 34), 4 rows beside the path, 12 + 4
    # from the goal. The nose at (0.8726 + 0.1 cos 1, 0.4626 + 0.1 sin 1) = (0.9266, 0.5468) is in
    # (39, 35): 5 beside, 12 + 5 from (51, 30).
    (1.03, 1.0): (0.0, 0.0, 17.0, 5.0, 4.0, 16.0),
}


def test_the_sums_of_the_table_are_right():
    """Sums of cos and sin of k a, k = 0..n-1, are sin(n a / 2) / sin(a / 2) times cos and sin of
    (n - 1) a / 2."""
    head = math.sin(0.5) / math.sin(0.0125)
    assert head * math.cos(39 * 0.0125) == pytest.approx(33.887, abs=1e-3)
    assert head * math.sin(39 * 0.0125) == pytest.approx(17.966, abs=1e-3)


@pytest.mark.parametrize("velocity", TABLE)
def test_the_critics_against_a_table_by_hand(velocity):
    """MapGrid critics count half a cell, 0.05 m; their scales are 24, 32, 32 and 24."""
    scores, totals = rated(bench(STRAIGHT), velocity)
    assert scores[0].tolist() == list(TABLE[velocity])
    _, _, goal_align, path_align, path, goal = TABLE[velocity]
    assert totals[0] == pytest.approx(0.05 * (24 * goal_align + 32 * path_align + 32 * path
                                              + 24 * goal))


def test_the_obstacle_critic():
    """A return at 20 degrees and 1.2 m: (1.1276, 0.4104). The body ends in cell (40, 30), whose
    middle (1.05, 0.05) is sqrt(0.0776^2 + 0.3604^2) = 0.3687 m away: int(252 exp(-10 (0.3687 -
    0.26))) = int(84.98). Scale 0.02, and 0.05 (24 * 10 + 32 * 1 + 24 * 10) of the others."""
    made = bench(STRAIGHT, [(1.2 * math.cos(math.radians(20)), 1.2 * math.sin(math.radians(20)))])
    scores, totals = rated(made, (1.03, 0.0))
    assert scores[0, 1] == 84.0
    assert totals[0] == pytest.approx(0.02 * 84 + 0.05 * 512)


def test_what_leads_within_the_inscribed_radius_is_not_legal():
    """A return 1.1 m ahead: at 1.03 m/s the body would end 0.07 m before it, at 0.53 m/s 0.57."""
    _, totals = rated(bench(STRAIGHT, [(1.1, 0.0)]), (1.03, 0.0), (0.53, 0.0))
    assert totals[0] == math.inf and totals[1] < math.inf
    _, totals = rated(bench(STRAIGHT), (3.03, 0.0))
    assert totals[0] == math.inf, "the local costmap ends 3 m ahead"


def test_the_rotation_critic():
    """Within 0.25 m of the goal: too fast to stand (0.3 > 0.25 m/s), only slower velocities pass,
    at 5 v^2 and the angle between the heading at the end and the path's. Once it stands, only turns
    pass."""
    made = bench([(-1.0, 0.0), (0.2, 0.0)])
    made.speed_mps = 0.3
    scores, totals = rated(made, (0.2, 0.4), (0.3, 0.0))
    assert scores[0, 0] == pytest.approx(5 * 0.2**2 + 0.4)
    assert totals[0] < math.inf and totals[1] == math.inf
    made.speed_mps = 0.2
    scores, totals = rated(made, (0.1, 0.0), (0.0, 0.4))
    assert totals[0] == math.inf and scores[1, 0] == pytest.approx(0.4)


def test_near_the_goal_nothing_pulls_the_nose_to_the_path():
    made = bench([(-1.0, 0.0), (0.05, 0.0)], constants={"xy_goal_tolerance": "0 m"})
    scores, totals = rated(made, (0.0, 0.5))
    assert totals[0] == pytest.approx(0.05 * (24 * scores[0, 2] + 32 * scores[0, 4]
                                              + 24 * scores[0, 5]))


def test_samples_are_nav2s():
    """With 4 samples from -1 to 1, zero comes in between: -1, -1/3, 0, 1/3, 1."""
    assert samples(0.0, -1.0, 1.0, 5.0, 4) == pytest.approx([-1, -1 / 3, 0, 1 / 3, 1])
    assert samples(0.5, 0.0, 1.2, 0.25, 3) == pytest.approx([0.25, 0.5, 0.75])
    assert samples(2.0, 0.0, 1.2, 0.25, 2) == pytest.approx([0.95, 1.2]), "what is too fast"
    assert samples(0.0, 0.0, 0.0, 1.0, 20) == [0.0]


@given(st.floats(-1.0, 1.0), st.floats(0.01, 3.0), st.integers(2, 40))
def test_samples_reach_from_end_to_end(now, reach, count):
    found = samples(now, -1.0, 1.0, reach, count)
    assert found[0] == max(-1.0, now - reach)
    assert found[-1] == pytest.approx(min(1.0, now + reach), abs=1e-5)
    assert count <= len(found) <= count + 1


def test_a_path_gets_points():
    """Over 0.45 m: int((0.45 - 0.2) / 0.1) - 1 = 1 step, no point between; over 1 m 7 steps."""
    assert len(resampled(np.array([(0.0, 0.0), (0.45, 0.0)]), 0.1)) == 2
    assert resampled(np.array([(0.0, 0.0), (1.0, 0.0)]), 0.1)[:, 0] == pytest.approx(
        [k / 7 for k in range(8)])


def test_a_sign_that_flipped_may_not_flip_back_until_it_has_moved():
    flips = Oscillation(0.05, 0.2, 0.05)
    flips.note((0.0, 0.0, 0.0), 0.0, 1.0)
    assert flips.forbidden == (False, False, False, False)
    flips.note((0.0, 0.0, 0.1), 0.0, -1.0)
    assert flips.forbidden == (False, False, True, False), "no turn to the left any more"
    flips.note((0.0, 0.0, 0.25), 0.0, -1.0)
    assert flips.forbidden[2], "it turned 0.15 rad since"
    flips.note((0.0, 0.0, 0.31), 0.0, -1.0)
    assert not any(flips.forbidden), "0.21 rad"
    flips.note((0.0, 0.0, 0.31), 0.3, 1.0)
    assert not any(flips.forbidden), "turns do not count while it drives"


def test_a_forbidden_turn_is_not_taken():
    made = bench([(0.0, 0.0), (-1.0, 1.0)])
    assert made.steer(20.0, 20.0, 0.0)[1] > 0.0
    made.planner._oscillation.note(made.position, 0.0, 1.0)
    made.planner._oscillation.note(made.position, 0.0, -1.0)
    assert made.steer(20.0, 20.0, 0.0)[1] <= 0.0


def test_without_a_legal_velocity_it_stands_and_says_so():
    made = bench(STRAIGHT, [(0.2, 0.0)])  # within its radius
    assert made.steer(20.0, 20.0, 0.0) == (0.0, 0.0, pytest.approx(2.0))
    assert made.is_blocked


def test_a_wrong_scale_of_cells_is_noticed(monkeypatch):
    """The twin: with whole cells in place of half ones the totals are others."""
    rate_all = dwb._rate_all
    monkeypatch.setattr(dwb, "_rate_all", lambda near2, setup, cells, velocities, scales, *out:
                        rate_all(near2, setup, cells, velocities, 2 * scales, *out))
    with pytest.raises(AssertionError):
        test_the_critics_against_a_table_by_hand((1.03, 0.0))


def test_a_wrong_order_of_euler_steps_is_noticed(monkeypatch):
    """The twin: with an exact arc the curve of the table ends elsewhere: y = 1.03 (1 - cos 1)."""
    assert math.floor(10 * 1.03 * (1.0 - math.cos(1.0))) == 4
    assert kernels.CRITICS.index("PathDist") == 4
    slow = BodyType(turn_acceleration="1 rad/s^2")
    scores, _ = rated(bench(STRAIGHT, body=slow), (1.03, 1.0))
    assert scores[0].tolist() != list(TABLE[1.03, 1.0])
