"""Navigation with a footprint: the room around it, turns, doors, and backing off."""

import math

import numpy as np
import pytest
from drawn import Drawn, costmap
from hypothesis import given
from hypothesis import strategies as st

from desim.middleware.contents import LaserScan
from desim.robot.mapping.tiles import FREE, OCCUPIED
from desim.robot.navigation.footprint_cover import cover
from desim.robot.navigation.kernels.footprint import body_clearance2
from desim.robot.navigation.local_planners.dynamic_window import DynamicWindow
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.navigation import Navigation
from desim.testing.local_planner_bench import LocalPlannerBench

BEAMS, HALF_VIEW = 361, math.pi
STEP = 2.0 * HALF_VIEW / (BEAMS - 1)
CELL_M = 0.1
AT = (20.0, 20.0)


def polygon(corners):
    around_m = max(math.hypot(x, y) for x, y in corners)
    return BodyType(footprint=[[f"{x!r} m", f"{y!r} m"] for x, y in corners],
                    radius=f"{around_m!r} m")


BAR = polygon([(0.6, 0.2), (-0.6, 0.2), (-0.6, -0.2), (0.6, -0.2)])
ROUND = polygon([(0.26 * math.cos(2 * math.pi * k / 64), 0.26 * math.sin(2 * math.pi * k / 64))
                 for k in range(64)])


def planner(body, way, walls=(), speed_mps=0.0, around=None):
    """At (20, 20), heading along x, among ``walls`` (x1, y1, x2, y2 from there), all of which its
    laser sees."""
    made = LocalPlannerBench(
        DynamicWindow(DynamicWindow.Params()), Navigation(), body,
        costmap(around or Drawn(np.full((200, 200), FREE, np.int16)), body.inscribed_radius_m))
    made.follow(np.add(way, AT))
    made.speed_mps = speed_mps
    angles = -HALF_VIEW + STEP * np.arange(BEAMS)
    ranges = np.full(BEAMS, 26.0)
    for x1, y1, x2, y2 in walls:
        with np.errstate(divide="ignore", invalid="ignore"):
            across = np.cos(angles) * (y2 - y1) - np.sin(angles) * (x2 - x1)
            t = (x1 * (y2 - y1) - y1 * (x2 - x1)) / across
            s = (x1 * np.sin(angles) - y1 * np.cos(angles)) / across
        ranges = np.where((s >= 0) & (s <= 1) & (t > 0), np.minimum(t, ranges), ranges)
    made.costmap.observe([(LaserScan(0, ranges.astype(np.float32), -HALF_VIEW, STEP, 26.0),
                           (*AT, 0.0))])
    return made


def passage(width_m, front_m=3.0, back_m=3.0):
    """A passage along x."""
    half = width_m / 2
    return [(-back_m, half, front_m, half), (-back_m, -half, front_m, -half)]


# -------------------------------------------------------------------------------------- the room


def test_a_disc_has_no_cover():
    assert cover(BodyType(), CELL_M).shape == (0, 3)


def test_the_cover_is_the_outline_and_what_is_inside():
    points = cover(BAR, CELL_M)
    x, y, wider = points.T
    rim = np.isclose(wider, -0.2)
    assert rim.sum() == 2 * (12 + 4)
    assert (np.isclose(np.abs(x[rim]), 0.6) | np.isclose(np.abs(y[rim]), 0.2)).all()
    depth = np.minimum(0.6 - np.abs(x), 0.2 - np.abs(y))
    assert np.allclose(wider, depth - 0.2, atol=1e-9)
    assert [0.0, 0.0, 0.0] in points.tolist(), "its middle is one of the inscribed radius"


def near2(points):
    """The layer around some points, 6 m wide."""
    centres = (np.arange(60) + 0.5 - 30) * CELL_M
    x, y = np.meshgrid(centres, centres)
    d2 = np.min([(x - px)**2 + (y - py)**2 for px, py in points], axis=0)
    return d2.astype(np.float32)


def to_bar(point, x, y, yaw):
    """The distance of a point from the bar at a pose; negative inside."""
    dx, dy = point[0] - x, point[1] - y
    ahead = abs(math.cos(yaw) * dx + math.sin(yaw) * dy) - 0.6
    left = abs(math.cos(yaw) * dy - math.sin(yaw) * dx) - 0.2
    return math.hypot(max(ahead, 0.0), max(left, 0.0)) + min(max(ahead, left), 0.0)


places = st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))


@given(st.lists(places, min_size=1, max_size=4), places, st.floats(-3.1, 3.1))
def test_the_room_is_the_distance_of_the_nearest_obstacle_from_the_outline(points, at, yaw):
    """As far as cells tell: half a diagonal, and as much for the points that stand for the rest."""
    room_m = math.sqrt(body_clearance2(near2(points), CELL_M, cover(BAR, CELL_M), *at, yaw)) - 0.2
    nearest_m = min(to_bar(point, *at, yaw) for point in points)
    assert room_m == pytest.approx(max(nearest_m, -0.2), abs=0.142)


@given(st.lists(places, min_size=1, max_size=4), places, st.floats(-3.1, 3.1))
def test_a_polygon_of_64_corners_has_the_room_of_its_disc(points, at, yaw):
    layer = near2(points)
    of_disc = math.sqrt(body_clearance2(layer, CELL_M, np.zeros((0, 3)), *at, yaw))
    of_polygon = math.sqrt(body_clearance2(layer, CELL_M, cover(ROUND, CELL_M), *at, yaw))
    assert of_polygon == pytest.approx(of_disc, abs=0.142)


# ---------------------------------------------------------------------------------------- turns


@pytest.mark.parametrize(("width_m", "by_rad", "can"), [
    (3.0, 2 * math.pi, True), (0.9, 2 * math.pi, False), (0.9, math.pi, False),
    (0.9, -1.0, False), (0.9, 0.1, True)])
def test_a_bar_turns_where_its_corners_have_room(width_m, by_rad, can):
    made = planner(BAR, [(0, 0), (2, 0)], passage(width_m))
    made.position = (*AT, 0.0)
    assert made.can_turn(by_rad) == can


def test_a_disc_turns_anywhere():
    made = planner(BodyType(), [(0, 0), (2, 0)], passage(0.6))
    made.position = (*AT, 0.0)
    assert made.can_turn(2 * math.pi)


def test_what_lies_behind_is_turned_to_where_that_is_possible_and_else_backed_to():
    open_v, open_w, _ = planner(BAR, [(0, 0), (-2, 0)], passage(3.0)).steer(*AT, 0.1)
    assert open_v == 0.0 and abs(open_w) > 1.0
    narrow = planner(BAR, [(0, 0), (-2, 0)], passage(0.9))
    assert narrow.steer(*AT, 0.0)[:2] == (-0.1, 0.0)  # TrajectoryPlannerROS, escape_vel
    assert not narrow.is_blocked
    disc_v, disc_w, _ = planner(BodyType(radius="0.2 m"), [(0, 0), (-2, 0)],
                                passage(0.9)).steer(*AT, 0.1)
    assert disc_v == 0.0 and abs(disc_w) > 1.0, "the twin: a disc turns"


@pytest.mark.parametrize("behind", ["clear", "seen", "on the map"])
def test_it_backs_off_unless_something_is_behind(behind):
    """The way ahead is shut."""
    walls, cells = [*passage(0.9), (0.75, 0.45, 0.75, -0.45)], np.full((200, 200), FREE, np.int16)
    if behind == "seen":
        walls.append((-0.65, 0.45, -0.65, -0.45))
    elif behind == "on the map":
        cells[97:103, 96] = OCCUPIED  # 0.8 to 0.6 m behind its middle
    made = planner(BAR, [(0, 0), (-2, 0)], walls, around=Drawn(cells))
    v, w, _ = made.steer(*AT, 0.0)
    assert (v, w, made.is_blocked) == ((-0.1, 0.0, False) if behind == "clear" else
                                       (0.0, 0.0, True))


# ------------------------------------------------------------------------------------- rollouts


def followed(body, walls, way, yaw=0.0, seconds=12.0):
    """Poses on the way, by steering ten times a second with ideal motors."""
    made = planner(body, way, walls)
    x, y, poses = *AT, []
    for _ in range(round(10 * seconds)):
        v, w, _ = made.steer(x, y, yaw)
        made.command(v, w)
        for _ in range(10):
            x, y = x + 0.01 * v * math.cos(yaw), y + 0.01 * v * math.sin(yaw)
            yaw += 0.01 * w
            poses.append((x - AT[0], y - AT[1], yaw))
    return np.array(poses)


DOOR = [(1.5, 0.45, 1.5, 3.0), (1.5, -0.45, 1.5, -3.0)]


@pytest.mark.parametrize("aside_m", [0.0, 0.5, -0.8])
def test_a_bar_steers_through_a_door_narrower_than_the_circle_around_it(aside_m):
    poses = followed(BAR, DOOR, [(0, aside_m), (0.4, 0), (2.6, 0)])
    assert poses[-1, 0] > 2.2
    jambs = [(1.5, 0.45), (1.5, -0.45)]
    assert min(to_bar(jamb, *pose) for pose in poses for jamb in jambs) > 0.0
    circle = BodyType(radius=f"{BAR.radius_m!r} m")
    assert followed(circle, DOOR, [(0, aside_m), (0.4, 0), (2.6, 0)])[:, 0].max() < 1.0


@given(st.floats(-0.6, 0.6), st.floats(0.9, 2.0), st.floats(-1.5, 1.5))
def test_no_command_leads_the_outline_into_what_is_seen(yaw, ahead_m, aside_m):
    """The rollout of the first command, and braking after it."""
    post = [(ahead_m, aside_m, ahead_m + 0.01, aside_m + 0.01)]
    made = planner(BAR, [(0, 0), (3, 0)], post, speed_mps=0.5)
    if to_bar((ahead_m, aside_m), 0.0, 0.0, yaw) < 0.35:
        return  # it may be too late to brake
    v, w, _ = made.steer(*AT, yaw)
    x, y, t = 0.0, 0.0, 0.0
    while v > 0.0:
        x, y, yaw = x + 0.01 * v * math.cos(yaw), y + 0.01 * v * math.sin(yaw), yaw + 0.01 * w
        t += 0.01
        v -= BAR.acceleration_mps2 * 0.01 if t > 0.1 else 0.0
        assert to_bar((ahead_m, aside_m), x, y, yaw) > 0.0
