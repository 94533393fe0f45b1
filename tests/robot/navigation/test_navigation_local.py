"""The local planner: the layer against brute force, and never into what it sees."""

import math

import numpy as np
import pytest
from drawn import Drawn, costmap, drawn
from hypothesis import example, given
from hypothesis import strategies as st

from desim.middleware.contents import LaserScan, Pose
from desim.robot.mapping.tiles import FREE
from desim.robot.navigation.kernels import local_costmap as kernels
from desim.robot.navigation.local_planners.dynamic_window import DynamicWindow
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.navigation import Navigation
from desim.testing.local_planner_bench import LocalPlannerBench

NAVIGATION, BODY = Navigation(), BodyType()
BEAMS, HALF_VIEW = 180, math.radians(95.0)
STEP = 2.0 * HALF_VIEW / (BEAMS - 1)


def scan(*hits, stamp_ns=0):
    """A scan with returns of the given (angle, range) and nothing else within 26 m."""
    ranges = np.full(BEAMS, 26.0, np.float32)
    for angle, r in hits:
        beam = round((angle + HALF_VIEW) / STEP)
        if 0 <= beam < BEAMS:
            ranges[beam] = min(r, ranges[beam])
    return LaserScan(stamp_ns, ranges, -HALF_VIEW, STEP, 26.0)


def points(sweep):
    angles = -HALF_VIEW + STEP * np.arange(BEAMS)
    seen = sweep.ranges < 26.0
    return np.stack((sweep.ranges * np.cos(angles), sweep.ranges * np.sin(angles)), 1)[seen]


def bench(robot_map):
    return LocalPlannerBench(DynamicWindow(DynamicWindow.Params()), NAVIGATION, BODY,
                             costmap(robot_map))


def planner(way, speed_mps=0.0, turn_radps=0.0):
    """On a large open floor."""
    made = bench(Drawn(np.full((200, 200), FREE, np.int16)))
    made.follow(np.array(way, float))
    made.speed_mps, made.turn_radps = speed_mps, turn_radps
    return made


hits = st.lists(st.tuples(st.floats(-1.6, 1.6), st.floats(0.1, 4.0)), max_size=20)


@given(hits)
@example([(0.0, 0.8984375), (0.03125, 0.921875)])
def test_the_layer_holds_the_distance_to_the_nearest_return(returns):
    made, sweep = planner([(20, 20)]), scan(*returns)
    made.costmap.observe([(sweep, (20.0, 20.0, 0.0))])
    centres = (np.arange(60) + 0.5 - 30) * 0.1
    x, y = np.meshgrid(centres, centres)
    distance = np.full((60, 60), np.inf)
    for px, py in points(sweep):
        distance = np.minimum(distance, np.hypot(x - px, y - py))
    # A return within 3 cm of another one is not entered.
    near = distance < made.costmap.layer["reach_m"] - 0.031
    assert np.allclose(np.sqrt(made.costmap.near2[near]), distance[near], atol=0.031)
    assert (np.sqrt(made.costmap.near2) >= distance - 1e-3)[np.isfinite(distance)].all()


def plain_stamps(places, size, cell_m, reach_m):
    """The layer of these points, in squares of ``reach_m`` around each."""
    layer, middle = np.full((size, size), kernels.FAR2), 0.5 * size - 0.5
    for x, y in places:
        columns, rows = (np.arange(max(math.ceil((at - reach_m) / cell_m + middle), 0),
                                   min(math.floor((at + reach_m) / cell_m + middle) + 1, size))
                         for at in (x, y))
        dx2 = ((columns - middle) * cell_m - x).astype(np.float32)**2
        dy2 = (((rows - middle) * cell_m - y)**2).astype(np.float32)
        square = np.ix_(rows, columns)
        layer[square] = np.minimum(layer[square], dx2 + dy2[:, None])
    return layer


@given(st.lists(st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)), min_size=1, max_size=6),
       st.integers(3, 30), st.sampled_from((0.05, 0.1, 0.3)), st.floats(0.1, 0.9))
def test_a_point_is_entered_in_a_square_and_nowhere_else(places, size, cell_m, reach_m):
    around = np.full((size + 2) * size, kernels.FAR2)  # a row before and after the layer
    layer, work = around[size:-size].reshape(size, size), np.empty(size, np.float32)
    for x, y in places:
        kernels.stamp(x, y, cell_m, reach_m, layer, work)
    assert np.array_equal(layer, plain_stamps(places, size, cell_m, reach_m))
    assert (around[:size] == kernels.FAR2).all() and (around[-size:] == kernels.FAR2).all()


def test_a_square_of_another_size_is_noticed():
    layer = np.full((30, 30), kernels.FAR2)
    kernels.stamp(0.3, -0.2, 0.1, 0.55, layer, np.empty(30, np.float32))
    assert np.array_equal(layer, plain_stamps([(0.3, -0.2)], 30, 0.1, 0.55))
    assert not np.array_equal(layer, plain_stamps([(0.3, -0.2)], 30, 0.1, 0.45))


@given(hits, st.floats(0.0, 1.2), st.floats(-2.0, 2.0), st.floats(-1.0, 1.0))
def test_it_never_commands_what_could_not_stop_before_what_it_sees(returns, speed, turn, aside):
    """From anywhere not too near to anything: drive the command for a control period, then brake.
    Nothing seen is touched by a body of the robot's radius."""
    made, sweep = planner([(20, 20), (24, 20 + aside)], speed, turn), scan(*returns)
    seen = points(sweep)
    if len(seen) and np.hypot(*seen.T).min() < 0.5:
        return
    made.costmap.observe([(sweep, (20.0, 20.0, 0.0))])
    v, w, _ = made.steer(20.0, 20.0, 0.0)
    slowest = max(0.0, speed - 0.25)
    assert v >= slowest - 1e-9
    if v <= slowest + 1e-9:
        return  # it brakes as hard as it can
    x, y, yaw, dt, t = 0.0, 0.0, 0.0, 0.01, 0.0
    while v > 0.0:
        x, y, yaw = x + v * dt * math.cos(yaw), y + v * dt * math.sin(yaw), yaw + w * dt
        t += dt
        if t > 0.1:
            v -= BODY.acceleration_mps2 * dt
        if len(seen):
            assert np.hypot(seen[:, 0] - x, seen[:, 1] - y).min() > BODY.radius_m


@given(st.floats(0.0, 1.2), st.floats(-3.0, 3.0), st.floats(0.3, 3.0), st.floats(-3.1, 3.1))
def test_commands_stay_in_the_dynamic_window(speed, turn, distance, bearing):
    end = (20 + distance * math.cos(bearing), 20 + distance * math.sin(bearing))
    made = planner([(20, 20), end], speed, turn)
    v, w, togo = made.steer(20.0, 20.0, 0.0)
    assert max(0.0, speed - 0.25) - 1e-9 <= v <= min(1.2, speed + 0.25) + 1e-9
    assert abs(w) <= BODY.max_turn_radps
    assert togo == pytest.approx(distance)


def test_it_speeds_up_on_a_free_way_and_turns_on_the_spot_for_one_behind():
    made = planner([(20, 20), (30, 20)])
    speeds = []
    for _ in range(6):
        v, w, _ = made.steer(20.0, 20.0, 0.0)
        made.command(v, w)
        speeds.append(round(v, 6))
    assert speeds == [0.25, 0.5, 0.75, 1.0, 1.2, 1.2]
    v, w, _ = planner([(20, 20), (10, 20)]).steer(20.0, 20.0, 0.1)
    assert v == 0.0
    # w^2 = 2 * 0.8 * 3.2 * off: the fastest turn that can stop in time (keep right: off < pi)
    assert 3.0 < w < math.sqrt(2 * 0.8 * 3.2 * math.pi) + 1e-9


def test_it_keeps_to_the_right_of_its_way():
    made = planner([(20, 20), (30, 20)], 1.2)
    x, y, yaw = 20.0, 20.0, 0.0
    for _ in range(50):
        v, w, _ = made.steer(x, y, yaw)
        made.command(v, w)
        x, y, yaw = x + 0.1 * v * math.cos(yaw), y + 0.1 * v * math.sin(yaw), yaw + 0.1 * w
    assert y == pytest.approx(20.0 - NAVIGATION.constants.keep_right_m, abs=0.1)
    assert yaw == pytest.approx(0.0, abs=0.1)


def test_it_gives_way_to_the_right_and_not_to_the_left():
    way, side = [(20, 20), (30, 20)], math.radians(75)
    for bearing, gives_way in ((-side, True), (side, False), (0.3, True)):
        made = planner(way, 1.2)
        made.costmap.observe([(scan((bearing, 0.65)), (20.0, 20.0, 0.0))])
        v, _, _ = made.steer(20.0, 20.0, 0.0)
        assert (v < 1.0) == gives_way, bearing


@pytest.mark.parametrize(("before_m", "come_mps"), [
    (1.58, 1.2),  # 0.48 m nearer in 0.2 s, of which the robot drove 0.24 m
    (1.34, 0.0),  # it stands, and the robot alone comes nearer
    (1.10, 0.0),  # it drives ahead as fast as the robot
])
def test_it_brakes_earlier_for_what_comes(before_m, come_mps):
    made = planner([(20, 20), (30, 20)], 1.2)
    made.costmap.observe([(scan((0.6, before_m)), (19.76, 20.0, 0.0))])
    made.costmap.observe([(scan((0.6, 1.1), stamp_ns=2 * 10**8), (20.0, 20.0, 0.0))])
    assert made.costmap.layer[0]["come_mps"] == pytest.approx(come_mps, abs=1e-6)
    v, _, _ = made.steer(20.0, 20.0, 0.0)
    # (1.1 - 0.36) m / 0.55 s - come_mps; it brakes by 0.25 m/s in a control period
    assert v == pytest.approx(1.2 if come_mps == 0.0 else 1.2 - 0.25)


def test_an_old_distance_says_nothing_of_what_comes():
    made = planner([(20, 20), (30, 20)])
    for stamp_ns in (0, 6 * 10**8):
        sweep = scan((-0.3, 1.6 - stamp_ns / 10**9), stamp_ns=stamp_ns)
        made.costmap.observe([(sweep, (20.0, 20.0, 0.0))])
    assert made.costmap.layer[0]["come_mps"] == 0.0


def test_who_stands_too_near_to_something_drives_on():
    """Its own place costs as much as the first step away; with a cost of 0 it would stand."""
    made = planner([(20, 20), (30, 20)])
    made.costmap.observe([(scan((-math.pi / 2, 0.33)), (20.0, 20.0, 0.0))])  # on its right
    assert made.steer(20.0, 20.0, 0.0)[0] > 0.0


def test_it_does_not_give_way_to_a_known_wall():
    lines = ["." * 40] * 12 + ["#" * 40] + ["." * 40] * 12
    made = bench(drawn(*lines))  # the wall is at y in [2.4, 2.6]
    made.follow(np.array([(1.0, 3.2), (7.0, 3.2)]))
    made.speed_mps = 1.2
    made.costmap.observe([(scan((-math.pi / 2, 0.6)), (3.0, 3.2, 0.0))])
    assert made.steer(3.0, 3.2, 0.0)[0] == pytest.approx(1.2)


def test_what_it_turned_away_from_is_remembered_for_a_while():
    made = planner([(20, 20), (22, 20)])
    made.costmap.observe([(scan((0.0, 0.8)), (20.0, 20.0, 0.0))])
    made.costmap.observe([(scan(stamp_ns=10**9), (20.0, 20.0, math.pi))])  # behind it now
    assert np.sqrt(made.costmap.near2[30, 22]) == pytest.approx(0.07, abs=0.03)
    made.costmap.observe([(scan(stamp_ns=3 * 10**9), (20.0, 20.0, math.pi))])
    assert (made.costmap.near2 > 0.5).all()


def test_what_is_in_view_and_gone_is_gone():
    made = planner([(20, 20), (22, 20)])
    made.costmap.observe([(scan((0.0, 0.8)), (20.0, 20.0, 0.0))])
    made.costmap.observe([(scan(stamp_ns=2 * 10**8), (20.0, 20.0, 0.1))])
    assert (made.costmap.near2 > 0.5).all()


def test_extrapolation_follows_the_arc():
    made = planner([(20, 20)], 1.0, math.pi)
    x, y, yaw = made.extrapolate(Pose(0, 0.0, 0.0, 0.0), 10**8)
    # after 0.1 s on a circle of radius 1 / pi: the chord is 2 r sin(turned / 2)
    assert math.hypot(x, y) == pytest.approx(0.1, rel=0.005)
    assert math.atan2(y, x) == pytest.approx(0.05 * math.pi)
    assert yaw == pytest.approx(0.1 * math.pi)


def rear(range_m, yaw_rad=math.pi):
    """A scan of three beams of a laser 0.2 m behind the middle, whose middle one sees something."""
    ranges = np.array([26.0, range_m, 26.0], np.float32)
    return LaserScan(0, ranges, yaw_rad - 0.1, 0.1, 26.0, -0.2, 0.0)


def test_the_scans_of_all_lasers_are_in_the_window():
    """One behind that is 0.5 m away from the middle, in the frame of the first scan's pose."""
    def nearest_m(placed, column=25, row=30):
        made = planner([(20, 20)])
        made.costmap.observe([(scan(), (20.0, 20.0, 0.0)), placed])
        return float(np.sqrt(made.costmap.near2[row, column]))

    at = 20.0, 20.0, 0.0
    assert nearest_m((rear(0.3), at)) == pytest.approx(0.07, abs=0.03)
    assert nearest_m((rear(0.3, 0.0), at)) > 0.3  # the twin: turned the other way
    # the robot had turned by a quarter when that laser scanned
    turned = rear(0.3), (20.0, 20.0, math.pi / 2)
    assert nearest_m(turned, 30, 25) == pytest.approx(0.07, abs=0.03)


def test_the_only_scan_is_the_same_whichever_way_it_is_taken_in():
    """Beams of a scan as they are, and as points that are seen from the middle."""
    sweep, windows = scan((-0.5, 0.8), (0.4, 0.7), (1.2, 0.9)), []
    for placed in ([sweep], [sweep, rear(26.0)]):
        made = planner([(20, 20)])
        made.costmap.observe([(one, (20.0, 20.0, 0.3)) for one in placed])
        windows.append(made.costmap.near2)
    np.testing.assert_allclose(*windows, atol=1e-5)
