"""ORCA: half-planes by hand, linear programmes against brute force, the paper's circle, robots."""

import math

import numpy as np
import pytest
from drawn import Drawn, costmap
from hypothesis import given
from hypothesis import strategies as st

from desim.middleware.contents import LaserScan
from desim.ports.kernels import compiled_function
from desim.robot.mapping.tiles import FREE, OCCUPIED
from desim.robot.navigation.kernels import orca as kernels
from desim.robot.navigation.local_planners.orca import Orca, _speed
from desim.robot.navigation.moving_bodies import MovingBodies
from desim.robot.team import Team
from desim.scenario.load import from_mapping
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.navigation import Navigation
from desim.testing.local_planner_bench import LocalPlannerBench

S = 10**9
solve, reciprocal = compiled_function(kernels.solve), compiled_function(kernels.reciprocal)


def planes_of(*others, velocity, radius, horizon_s):
    """The half-planes of others (x, y, vx, vy, radius)."""
    planes = np.zeros((len(others), 4))
    reciprocal(np.array(others, float).reshape(-1, 5), *velocity, radius, horizon_s, 0.25, planes)
    return planes


def test_head_on_each_takes_half():
    """Two discs of 0.5 m, 4 m apart, towards each other at 0.9 and 1 m/s, for 2 s: the velocity
    obstacle begins with a disc of radius 1 / 2 at (4, 0) / 2. The relative velocity (1.9, 0) is 0.1
    before its middle, and u = (-0.4, 0): each slows down by 0.2 m/s. Together they drive 3 m then,
    and 1 m is left between their middles."""
    plane, = planes_of((4, 0, -1, 0, 0.5), velocity=(0.9, 0.0), radius=0.5, horizon_s=2.0)
    assert plane == pytest.approx([0.7, 0.0, -1.0, 0.0], abs=1e-6)


def test_beside_a_leg_each_takes_half():
    """With 3.1 m/s relative to it and a little to the left the left leg is nearest: it leans by
    asin(1 / 4), d = (0.96825, 0.25), and u = (v d) d - v with v = (3, 0.1)."""
    plane, = planes_of((4, 0, -1, 0, 0.5), velocity=(2.0, 0.1), radius=0.5, horizon_s=2.0)
    d = np.array([math.sqrt(1.0 - 1.0 / 16.0), 0.25])
    u = (d @ (3.0, 0.1)) * d - (3.0, 0.1)
    assert u == pytest.approx([-0.1633, 0.6324], abs=1e-4)
    assert plane[:2] == pytest.approx([2.0 + 0.5 * u[0], 0.1 + 0.5 * u[1]])
    assert plane[2:] == pytest.approx([-0.25, d[0]])


def test_discs_that_overlap_get_apart_in_a_step():
    """0.8 m between discs of 0.5 m, at rest: 0.2 m in 0.25 s, half of it each."""
    plane, = planes_of((0.8, 0, 0, 0, 0.5), velocity=(0.0, 0.0), radius=0.5, horizon_s=2.0)
    assert plane == pytest.approx([-0.4, 0.0, -1.0, 0.0])


@given(st.floats(-4, 4), st.floats(1.2, 4), st.floats(-2, 2), st.floats(-2, 2), st.floats(-2, 2),
       st.floats(-2, 2), st.floats(0.3, 5))
def test_halves_together_avoid_the_collision(x, y, vx, vy, ox, oy, horizon_s):
    """If both take the velocity nearest to their own on their edges, they do not meet within the
    horizon."""
    mine, = planes_of((x, y, ox, oy, 0.5), velocity=(vx, vy), radius=0.5, horizon_s=horizon_s)
    theirs, = planes_of((-x, -y, vx, vy, 0.5), velocity=(ox, oy), radius=0.5, horizon_s=horizon_s)

    def taken(velocity, plane):
        lack = (plane[:2] - velocity) @ plane[2:]
        return velocity + max(lack, 0.0) * plane[2:]

    relative = taken(np.array([vx, vy]), mine) - taken(np.array([ox, oy]), theirs)
    t = np.linspace(0.0, horizon_s, 200)[:, None]
    assert np.hypot(*((x, y) - t * relative).T).min() > 1.0 - 1e-3


# By hundredths: RVO2 takes edges for parallel whose sine is below 1e-5.
angles = st.lists(st.tuples(st.integers(0, 628).map(lambda k: k / 100), st.floats(-1.0, 1.0)),
                  max_size=6)


@given(angles, st.floats(-2, 2), st.floats(-2, 2))
def test_the_velocity_is_the_nearest_that_is_allowed(edges, wx, wy):
    planes = np.array([(far * math.cos(a), far * math.sin(a), math.cos(a), math.sin(a))
                       for a, far in edges]).reshape(-1, 4)
    found = np.array(solve(planes, 0, 1.5, wx, wy))
    x, y = np.meshgrid(*[np.linspace(-1.5, 1.5, 121)] * 2)
    grid = np.column_stack([x.ravel(), y.ravel()])
    grid = grid[np.hypot(*grid.T) <= 1.5]
    room = ((grid[:, None] - planes[:, :2]) * planes[:, 2:]).sum(axis=2).min(axis=1, initial=9.0)
    own = ((found - planes[:, :2]) * planes[:, 2:]).sum(axis=1).min(initial=9.0)
    assert np.hypot(*found) <= 1.5 + 1e-9
    if (room >= 0.0).any():
        assert own >= -1e-3
        best = np.hypot(*(grid[room >= 0.0] - (wx, wy)).T).min()
        assert np.hypot(*(found - (wx, wy))) <= best + 1e-6
    else:
        assert own >= room.max() - 1e-3, "the safest one"


def test_what_is_hard_holds_in_any_case():
    """x >= 1 of a wall and x <= -1 of a neighbour: the wall's."""
    planes = np.array([(1.0, 0, 1.0, 0), (-1.0, 0, -1.0, 0)])
    assert solve(planes, 1, 2.0, 0.0, 0.0)[0] == pytest.approx(1.0)
    assert solve(planes, 0, 2.0, 0.0, 0.0)[0] == pytest.approx(0.0)


# ------------------------------------------------------------------------------------ the circle

RADIUS_M, CIRCLE_M, STEP_S, HORIZON_S = 1.5, 40.0, 0.25, 10.0


def starts(count):
    """On a circle, each moved a little: in perfect symmetry all wait for each other."""
    a = 2 * math.pi * np.arange(count) / count
    return CIRCLE_M * np.stack([np.cos(a), np.sin(a)], 1) + 0.5 * np.random.Generator(
        np.random.PCG64(1)).standard_normal((count, 2))


def wanted(place, start):
    """1 m/s to the opposite side."""
    away = -start - place
    return away * min(1.0, 1.0 / math.hypot(*away))


def crossing(place, step):
    """The times of arrival, and the least distance between two middles less two radii."""
    start, arrived, gap_m, time_s = place, np.full(len(place), np.inf), np.inf, 0.0
    while not np.isfinite(arrived).all():
        assert time_s < 400.0, "they wait for each other"
        place, time_s = step(place), time_s + STEP_S
        apart = np.hypot(*(place[:, None] - place).transpose(2, 0, 1)) + 1e9 * np.eye(len(place))
        gap_m = min(gap_m, apart.min() - 2 * RADIUS_M)
        there = np.hypot(*(place + start).T) < RADIUS_M
        arrived = np.where(there, np.minimum(arrived, time_s), arrived)
    return arrived, gap_m


def ours(start, avoids=True):
    velocities = np.zeros_like(start)

    def step(place):
        new = np.zeros_like(place)
        for i in range(len(place)):
            away = place - place[i]
            near = [j for j in np.argsort(np.hypot(*away.T), kind="stable")
                    if j != i and math.hypot(*away[j]) < 15.0][:10 if avoids else 0]
            planes = planes_of(*((*away[j], *velocities[j], RADIUS_M) for j in near),
                               velocity=velocities[i].tolist(), radius=RADIUS_M,
                               horizon_s=HORIZON_S)
            new[i] = solve(planes, 0, 2.0, *wanted(place[i], start[i]).tolist())
        velocities[:] = new
        return place + STEP_S * new

    return crossing(start, step)


def rvo2(start):
    pyrvo = pytest.importorskip("pyrvo", reason="RVO2's library is not installed: pip install "
                                                "pyrvo")
    library = pyrvo.RVOSimulator()
    library.set_time_step(STEP_S)
    library.set_agent_defaults(15.0, 10, HORIZON_S, HORIZON_S, RADIUS_M, 2.0, (0.0, 0.0))
    for place in start.tolist():
        library.add_agent(tuple(place))

    def step(place):
        for i in range(len(place)):
            library.set_agent_pref_velocity(i, tuple(wanted(place[i], start[i]).tolist()))
        library.do_step()
        now = [library.get_agent_position(i) for i in range(len(place))]
        return np.array([(one.x, one.y) for one in now])

    return crossing(start, step)


def test_thirty_discs_cross_the_circle():
    """Bodies of 1.4 m in discs of 1.5 m do not touch, and arrive later than straight on at 1 m/s.
    (In the dense middle there is no velocity in all half-planes; RVO2's discs overlap as much.)"""
    start = starts(30)
    arrived, gap_m = ours(start)
    assert gap_m + 0.2 > 0.0
    straight_s = 2.0 * np.hypot(*start.T) - RADIUS_M
    assert straight_s.mean() < arrived.mean() < 1.5 * straight_s.mean()
    assert arrived.max() < 150.0


def test_thirty_discs_cross_as_those_of_rvo2():
    """Times and gaps, beside the authors' library in single precision."""
    (own, own_gap_m), (theirs, gap_m) = ours(starts(30)), rvo2(starts(30))
    assert own.mean() == pytest.approx(theirs.mean(), rel=0.01)
    assert own.max() == pytest.approx(theirs.max(), rel=0.05)
    assert own_gap_m == pytest.approx(gap_m, abs=1e-3)


def test_discs_that_do_not_avoid_each_other_collide():
    """The twin."""
    _, gap_m = ours(starts(30), avoids=False)
    assert gap_m + 0.2 < 0.0


# --------------------------------------------------------------------------------- moving bodies

BODY, NAVIGATION = BodyType(), Navigation()
HERE = np.array([10.0, 10.0])


def disc(x, y, radius_m=0.26, count=9):
    """Points of the near side of a disc, as seen from ``HERE``, left to right."""
    toward = math.atan2(HERE[1] - y, HERE[0] - x)
    beside = np.linspace(-0.95, 0.95, count)
    a = toward + np.arcsin(beside)
    return np.column_stack([x + radius_m * np.cos(a), y + radius_m * np.sin(a)])


def bodies(cells=None, **team):
    cells = np.full((100, 100), FREE, np.int16) if cells is None else cells
    made = Team(("mate",), 30 * S, **team)
    return MovingBodies(made, costmap(Drawn(cells)), 0.26), made


def test_a_body_that_comes_is_followed():
    moving, _ = bodies()
    for k in range(4):
        moving.observe(disc(13.0 - 0.2 * k, 10.0), HERE, k * S // 5)
    found, = moving.around(HERE, 3 * S // 5)
    assert found.name == ""
    assert (found.x_m, found.y_m) == pytest.approx((12.4, 10.0), abs=0.05)
    assert (found.x_mps, found.y_mps) == pytest.approx((-1.0, 0.0), abs=0.05)
    later, = moving.around(HERE, 4 * S // 5)
    assert later.x_m == pytest.approx(12.2, abs=0.05)
    moving.observe(np.zeros((0, 2)), HERE, 2 * S)
    assert moving.around(HERE, 2 * S) == [], "not seen for long"


def test_what_stands_or_is_wide_or_on_the_map_does_not_move():
    cells = np.full((100, 100), FREE, np.int16)
    cells[45:56, 60:70] = OCCUPIED  # x from 12 m
    for known, x_m, wide_m, step_m in ((None, 13.0, 0.26, 0.0), (None, 13.0, 1.0, 0.2),
                                       (cells, 13.0, 0.26, 0.2)):
        moving, _ = bodies(known)
        for k in range(4):
            moving.observe(disc(x_m - step_m * k, 10.0, wide_m), HERE, k * S // 5)
        assert moving.around(HERE, 3 * S // 5) == []


def test_announced_poses_make_a_velocity():
    moving, team = bodies()
    team.note_pose("mate", 8.0, 10.0, 0.0, 0, 0)
    assert moving.around(HERE, 0) == []
    team.note_pose("mate", 8.5, 10.0, 0.0, S, S)
    found, = moving.around(HERE, 3 * S // 2)
    assert found == ("mate", pytest.approx(8.75), 10.0, pytest.approx(0.5), 0.0, 0.26)
    assert moving.around(HERE, 3 * S) == [], "it may be anywhere by now"


def test_a_teammate_in_view_has_its_name_once():
    moving, team = bodies()
    for k in range(6):
        if k % 5 == 0:
            team.note_pose("mate", 13.0 - 0.2 * k, 10.1, 0.0, k * S // 5, k * S // 5)
        moving.observe(disc(13.0 - 0.2 * k, 10.0), HERE, k * S // 5)
        seen = moving.around(HERE, k * S // 5)
    assert [one.name for one in seen] == ["mate"]


def test_one_that_starts_is_as_fast_as_between_the_last_two_scans():
    moving, _ = bodies()
    for k, x_m in enumerate((13.0, 13.0, 13.0, 12.8)):
        moving.observe(disc(x_m, 10.0), HERE, k * S // 5)
    found, = moving.around(HERE, 3 * S // 5)
    assert found.x_mps == pytest.approx(-1.0, abs=0.05)


def test_a_teammate_that_comes_into_view_is_as_fast_as_it_announced():
    moving, team = bodies()
    for k in range(2):
        team.note_pose("mate", 14.0 - k, 10.0, 0.0, k * S, k * S)
        moving.around(HERE, k * S)
    moving.observe(disc(13.0, 10.0), HERE, S)
    found, = moving.around(HERE, S)
    assert (found.name, found.x_mps) == ("mate", pytest.approx(-1.0))


def test_poses_in_other_frames_say_nothing():
    moving, team = bodies(common_frame=False)
    for k in range(2):
        team.note_pose("mate", 8.0 + 0.5 * k, 10.0, 0.0, k * S, k * S)
    assert moving.around(HERE, S) == []


# --------------------------------------------------------------------------------------- a robot

def robot(moving=None):
    """At (10, 10), heading along x, with a way that leads on."""
    made = LocalPlannerBench(Orca(Orca.Params()), NAVIGATION, BODY, costmap(Drawn(
        np.full((100, 100), FREE, np.int16))), moving)
    made.follow(np.array([(10.0, 10.0), (16.0, 10.0)]))
    made.speed_mps = 1.0
    see(made)
    return made


def see(made, *hits):
    ranges = np.full(361, 26.0, np.float32)
    for degrees, r in hits:
        ranges[degrees + 180] = r
    made.costmap.observe([(LaserScan(0, ranges, -math.pi, math.pi / 180, 26.0),
                           (10.0, 10.0, 0.0))])


def test_alone_it_drives_to_the_path_at_full_speed():
    v, w, togo = robot().steer(10.0, 10.0, 0.0)
    assert v == pytest.approx(1.2, abs=0.01) and abs(w) < 0.05 and togo == pytest.approx(6.0)


def test_it_gives_way_to_one_that_comes():
    moving, _ = bodies()
    for k in range(4):
        moving.observe(disc(13.0 - 0.2 * k, 10.1), HERE, k * S // 5 - 3 * S // 5)
    v, w, _ = robot(moving).steer(10.0, 10.0, 0.0)
    assert w < -0.3 or v < 0.9
    alone_v, alone_w, _ = robot().steer(10.0, 10.0, 0.0)
    assert (alone_v, abs(alone_w)) == pytest.approx((1.2, 0.0), abs=0.05)


def test_it_is_no_faster_than_its_heading_allows_by_now():
    """Half to the left, where 0.3 m/s are allowed, and it cannot turn at once: 0.3 m/s / sin 45
    degrees. A wall's half-plane comes before a neighbour's."""
    heading = np.full(2, math.sqrt(0.5))
    left = (0.0, 0.3, 0.0, -1.0)
    assert _speed(np.array([left]), 0, heading, np.zeros(2), 1.2, 1.2) == pytest.approx(0.4)
    assert _speed(np.array([left]), 0, heading, np.array([0.1, -0.1]), 1.2, 1.2
                  ) == pytest.approx(0.55)
    wall, from_behind = (0.0, 0.0, 0.0, -1.0), (0.0, 1.0, 0.0, 1.0)
    assert _speed(np.array([wall, from_behind]), 1, heading, np.zeros(2), 1.2, 1.2) == 0.0
    assert _speed(np.array([wall, from_behind]), 0, heading, np.zeros(2), 1.2, 1.2) > 0.5


def test_it_stops_before_a_wall():
    """Room for 0.5 m: the disc of 0.36 m is around the point 0.1 m ahead of the axle. With returns
    at 0.96 m it may have (0.86 - 0.36) / 1 s."""
    made = robot()
    see(made, *((k, 0.96 / math.cos(math.radians(k))) for k in range(-60, 61)))
    assert made.steer(10.0, 10.0, 0.0)[0] == pytest.approx(0.5, abs=0.02)
    see(made, *((k, 0.4 / math.cos(math.radians(k))) for k in range(-85, 86)))
    v, _, _ = made.steer(10.0, 10.0, 0.0)
    assert v < 0.01


def test_it_turns_on_the_spot_towards_what_lies_behind():
    made = robot()
    made.follow(np.array([(10.0, 10.0), (5.0, 10.5)]))
    made.speed_mps = 0.0
    v, w, _ = made.steer(10.0, 10.0, 0.0)
    assert v == 0.0 and abs(w) > 1.0


def test_its_team_announces_poses():
    """Every second, unless the scenario says otherwise; with another local planner nobody does."""
    def period(**navigation):
        scenario = from_mapping({"name": "o", "robot": {"navigation": navigation}}).scenario
        return scenario.coordination.team_state

    assert period(local="orca").period_ns == S
    assert period(local="dwb") is period() is None
