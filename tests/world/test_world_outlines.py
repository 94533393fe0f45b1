"""Bodies that are polygons: contacts, turns, starts, and lasers that see them."""

import math
from fractions import Fraction
from functools import partial

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from PIL import Image

from desim.engine.streams import Streams
from desim.errors import InputError
from desim.scenario.schema.environment import Door, Environment, MapFile, MovingObstacle, Shape
from desim.scenario.schema.fleet import BodyType, StartRandom
from desim.scenario.schema.robot import Laser
from desim.units import NS_PER_S
from desim.world.fleet import RobotSpec
from desim.world.geometry import point_distance
from desim.world.kernels import outline as kernels
from desim.world.outlines import Outlines
from desim.world.plane import Plane

OVERLAP_M = 0.01  # the promise
NONE = (0.0, 0.0, 0.0)


def polygon(corners, **more):
    """A body; a scenario has the radius filled in."""
    around_m = max(math.hypot(x, y) for x, y in corners)
    return BodyType(footprint=[[f"{float(x)!r} m", f"{float(y)!r} m"] for x, y in corners],
                    radius=f"{float(around_m)!r} m", **more)


def bar(length_m=1.2, width_m=0.4, **more):
    x, y = length_m / 2, width_m / 2
    return polygon([(x, y), (-x, y), (-x, -y), (x, -y)], **more)


def regular(count, radius_m=0.26, **more):
    angles = 2 * np.pi * np.arange(count) / count
    return polygon([(radius_m * math.cos(a), radius_m * math.sin(a)) for a in angles], **more)


def square(side=20, **more):
    return Environment(terrain=Shape(size=(f"{side} m", f"{side} m"), **more))


def world(starts, bodies, environment=None, **more):
    bodies = bodies if isinstance(bodies, list) else [bodies] * len(starts)
    specs = [RobotSpec(f"robot_{i}", body, *start, **more)
             for i, (start, body) in enumerate(zip(starts, bodies, strict=True))]
    return Plane(environment or square(), specs, Fraction(60), Streams(1))


def run(plane, seconds, *velocities, check=lambda plane: None, every=1):
    """The contacts met while each robot is told its velocity in every tick: (forward, left, turn),
    or a function of the tick. ``check`` sees one tick in ``every``."""
    first = round(plane.snapshot().time_ns * 60 / NS_PER_S)
    contacts = []
    for k in range(first, first + round(60 * seconds)):
        for robot, velocity in enumerate(velocities):
            plane.command(robot, *(velocity(k) if callable(velocity) else velocity))
        plane.advance((k + 1) * NS_PER_S // 60)
        contacts += plane.contacts()
        if k % every == 0:
            check(plane)
    return contacts


def shapes(plane):
    """The corners of each robot on the ground."""
    outlines = plane._bodies.outlines
    placed = outlines.at(plane.snapshot().poses).placed
    return [placed[a:b] for a, b in zip(outlines.first, outlines.first[1:], strict=False)]


def no_overlap(plane):
    """No two bodies, and no body and wall, are into each other. By numpy, not by the kernels."""
    own = shapes(plane)
    discs = np.column_stack([plane.snapshot().poses[:, :2], plane._bodies.radii_m]).tolist()
    lines = (plane._walls if plane.terrain.raster is None else plane.terrain.walls
             ).reshape(-1, 2, 2)
    for i, shape in enumerate(own):
        if not len(shape):
            continue
        assert gaps_m(shape, lines).min() > -OVERLAP_M
        for j, other in enumerate(own):
            if j > i and len(other):
                assert gaps_m(shape, other[None])[0] > -OVERLAP_M
            elif j != i and not len(other):
                assert disc_gap_m(shape, *discs[j]) > -OVERLAP_M


def gaps_m(polygon: np.ndarray, others: np.ndarray) -> np.ndarray:
    """[n] m by which convex ``others`` [n, m, 2] (lines too, m = 2) lie beside ``polygon`` [k, 2],
    along the normal of a side where that is most; negative where they overlap. All corners are
    anticlockwise."""
    between = beyond(polygon[None], others)
    return np.maximum(between, beyond(others, polygon[None]))


def beyond(polygons: np.ndarray, others: np.ndarray) -> np.ndarray:
    """[n] the same along normals of sides of ``polygons`` alone."""
    sides = np.roll(polygons, -1, axis=1) - polygons
    normals = np.stack([sides[..., 1], -sides[..., 0]], axis=2)
    normals /= np.hypot(sides[..., 0], sides[..., 1])[..., None]
    ends = (normals * polygons).sum(axis=2)
    return ((normals @ others.transpose(0, 2, 1)).min(axis=2) - ends).max(axis=1)


def disc_gap_m(polygon: np.ndarray, x_m: float, y_m: float, radius_m: float) -> float:
    """The distance in m of a disc from ``polygon`` [k, 2]; negative where they overlap."""
    centre = np.array([[x_m, y_m]])
    sides = np.hstack([polygon, np.roll(polygon, -1, axis=0)])
    inside = beyond(polygon[None], centre[None])[0] <= 0.0
    return float(-radius_m if inside else point_distance(centre, sides).min() - radius_m)


# ------------------------------------------------------------------------------------- geometry


def turned(corners, x, y, yaw):
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array(corners) @ np.array([[c, s], [-s, c]]) + (x, y)


@st.composite
def convex(draw):
    """A convex polygon around the origin, anticlockwise: corners on an ellipse."""
    count = draw(st.integers(3, 8))
    shifts = draw(st.lists(st.floats(-0.2, 0.2), min_size=count, max_size=count))
    a, b = draw(st.floats(0.2, 1.5)), draw(st.floats(0.2, 1.5))
    angles = [2 * math.pi * (i + shift) / count for i, shift in enumerate(shifts)]
    return np.round([(a * math.cos(t), b * math.sin(t)) for t in angles], 6)


poses = st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))


def test_squares_part_by_the_shorter_way():
    unit = np.array([(0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)])
    contact = partial(kernels.overlap, unit)
    assert contact(unit + (0.9, 0.3), NONE) == pytest.approx((0.1, -1.0, 0.0))
    assert contact(unit + (-0.4, 0.8), NONE) == pytest.approx((0.2, 0.0, -1.0))
    assert contact(unit + (1.01, 0.0), NONE) == NONE
    assert contact(unit + (0.9, 0.3), (0.3, 1.0, 0.0)) == (0.3, 1.0, 0.0), "the deeper one counts"
    corner = turned(unit, 0.5 + math.sqrt(0.5) - 0.05, 0.0, math.pi / 4)
    assert contact(corner, NONE) == pytest.approx((0.05, -1.0, 0.0))


def test_a_square_and_a_disc_part_by_the_shortest_way():
    unit = np.array([(0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)])
    contact = partial(kernels.against_disc, unit)
    assert contact(0.7, 0.1, 0.3, NONE) == pytest.approx((0.1, -1.0, 0.0))
    depth = 0.3 - math.hypot(0.1, 0.2)  # at a corner
    assert contact(0.6, 0.7, 0.3, NONE) == pytest.approx(
        (depth, -0.1 / math.hypot(0.1, 0.2), -0.2 / math.hypot(0.1, 0.2)))
    assert contact(0.4, 0.1, 0.3, NONE) == pytest.approx((0.4, -1.0, 0.0)), "its middle is inside"
    assert contact(0.9, 0.0, 0.3, NONE) == NONE


@given(convex(), convex(), poses)
def test_what_is_pushed_out_touches_and_no_shorter_push_does(p, q, pose):
    q = turned(q, *pose)
    depth, nx, ny = kernels.overlap(p, q, NONE)
    assert depth == pytest.approx(max(-gaps_m(p, q[None])[0], 0.0), abs=1e-9)
    if depth > 1e-6:
        assert gaps_m(p + np.multiply(depth, (nx, ny)), q[None])[0] == pytest.approx(0.0, abs=1e-9)
        for angle in np.linspace(0.0, 2 * np.pi, 16):  # nor one in another direction
            other = p + 0.99 * depth * np.array([math.cos(angle), math.sin(angle)])
            assert gaps_m(other, q[None])[0] < 0.0


@given(convex(), convex(), poses)
def test_the_other_one_is_pushed_the_other_way(p, q, pose):
    q = turned(q, *pose)
    depth, nx, ny = kernels.overlap(p, q, NONE)
    back, bx, by = kernels.overlap(q, p, NONE)
    assert back == pytest.approx(depth, abs=1e-9)
    if depth > 1e-6:
        assert gaps_m(q + np.multiply(depth, (bx, by)), p[None])[0] == pytest.approx(0, abs=1e-9)


@given(convex(), convex(), poses, poses)
def test_a_turn_of_the_whole_changes_no_depth(p, q, pose, frame):
    q = turned(q, *pose)
    depth, nx, ny = kernels.overlap(p, q, NONE)
    assert kernels.overlap(turned(p, *frame), turned(q, *frame), NONE)[0] == pytest.approx(
        depth, abs=1e-9)


@given(convex(), poses, st.floats(0.05, 1.0))
def test_a_disc_is_a_polygon_of_many_corners(p, pose, radius_m):
    x, y, _ = pose
    many = turned([(radius_m * math.cos(t), radius_m * math.sin(t))
                   for t in 2 * np.pi * np.arange(256) / 256], x, y, 0.0)
    as_disc = kernels.against_disc(p, x, y, radius_m, NONE)[0]
    assert kernels.overlap(p, many, NONE)[0] == pytest.approx(as_disc, abs=2e-4 * radius_m + 1e-9)


@given(convex(), st.floats(0.1, 0.9), poses)
def test_a_smaller_polygon_inside_overlaps_by_more_than_its_room(p, share, pose):
    """Containment: the way out of it is as long as that of its farthest corner."""
    inner = share * p
    depth, nx, ny = kernels.overlap(inner, p, NONE)
    assert depth > 0.0
    assert gaps_m(inner + np.multiply(depth, (nx, ny)), p[None])[0] == pytest.approx(0, abs=1e-9)


@given(convex(), poses, poses)
def test_a_line_is_a_polygon_of_two_corners(p, a, b):
    line = np.array([a[:2], b[:2]])
    assume(math.dist(*line) > 0.01)
    depth, nx, ny = kernels.overlap(p, line, NONE)
    points = line[0] + np.linspace(0.0, 1.0, 200)[:, None] * (line[1] - line[0])
    sides = np.roll(p, -1, axis=0) - p
    inside = (sides[:, 0] * (points[:, None, 1] - p[:, 1])
              - sides[:, 1] * (points[:, None, 0] - p[:, 0]) > 0.0).all(axis=1)
    if inside.any():
        assert depth > 0.0
    if depth > 0.02:
        assert inside.any()


# --------------------------------------------------------------------------------------- motion


def test_the_front_of_a_bar_stops_at_a_wall_and_is_one_collision():
    plane = world([(8.0, 0.0, 0.0)], bar())
    assert run(plane, 4.0, (1.2, 0.0, 0.0), check=no_overlap) == [(0, -1)]
    assert plane.snapshot().poses[0, 0] == pytest.approx(10.0 - 0.6, abs=1e-6)
    assert plane.velocities[0, 0] < 0.05


def test_a_bar_slides_along_a_wall_without_turning():
    plane = world([(8.5, 0.0, math.radians(70))], bar())
    run(plane, 4.0, (1.0, 0.0, 0.0), check=no_overlap)
    x, y, yaw = plane.snapshot().poses[0]
    reach_m = 0.6 * math.cos(math.radians(70)) + 0.2 * math.sin(math.radians(70))
    assert x == pytest.approx(10.0 - reach_m, abs=1e-6)
    assert y > 2.0 and yaw == pytest.approx(math.radians(70))


# A bar of length a and width b reaches a/2 sin t + b/2 cos t aside when it has turned by t.
@pytest.mark.parametrize(("width_m", "turns_rad"), [
    (0.6, 2 * math.asin(0.3 / math.hypot(0.6, 0.2)) / 2 - math.atan2(0.2, 0.6)),
    (1.0, math.asin(0.5 / math.hypot(0.6, 0.2)) - math.atan2(0.2, 0.6)),
    (1.27, math.inf)])
def test_between_walls_a_bar_turns_as_far_as_its_corners_let_it(width_m, turns_rad):
    passage = Environment(terrain=Shape(size=("20 m", f"{width_m} m")))
    plane = world([(0.0, 0.0, 0.0)], bar(), passage)
    contacts = run(plane, 6.0, (0.0, 0.0, 1.0), check=no_overlap)
    yaw = plane.snapshot().poses[0, 2]
    if turns_rad == math.inf:
        assert contacts == [] and yaw == pytest.approx(6.0 - 0.155 - 2 * math.pi, abs=0.02)
    else:
        assert contacts == [(0, -1)], "it is stopped, and that is one collision"
        assert yaw == pytest.approx(turns_rad, abs=0.02)
        assert plane.velocities[0, 2] == 0.0
        assert abs(plane.snapshot().poses[0, 0]) < 0.05


def test_a_disc_of_the_same_inner_radius_turns_there():
    """The twin of the last: a disc can always turn."""
    passage = Environment(terrain=Shape(size=("20 m", "0.6 m")))
    plane = world([(0.0, 0.0, 0.0)], BodyType(radius="0.2 m"), passage)
    assert run(plane, 6.0, (0.0, 0.0, 1.0)) == []
    assert plane.velocities[0, 2] == 1.0


def test_a_bar_that_cannot_turn_drives_on_and_out():
    passage = Environment(terrain=Shape(size=("20 m", "0.6 m")))
    plane = world([(0.0, 0.0, 0.0)], bar(), passage)
    run(plane, 3.0, (0.0, 0.0, 1.0))
    run(plane, 0.5, (0.0, 0.0, -1.0))
    assert run(plane, 3.0, (-1.0, 0.0, 0.0), check=no_overlap) is not None
    assert plane.snapshot().poses[0, 0] < -2.0


DOOR = square(walls=[{"from": ("0 m", "-10 m"), "to": ("0 m", "-0.3 m")},
                     {"from": ("0 m", "0.3 m"), "to": ("0 m", "10 m")}])


@pytest.mark.parametrize(("body", "passes"), [
    (bar(), True), (BodyType(radius=f"{math.hypot(0.6, 0.2)} m"), False),
    (bar(0.4, 1.2), False)])  # the circle around it, and the bar aslant, do not
def test_a_bar_passes_a_door_narrower_than_the_circle_around_it(body, passes):
    plane = world([(-2.0, 0.0, 0.0)], body, DOOR)
    contacts = run(plane, 5.0, (1.0, 0.0, 0.0), check=no_overlap)
    assert (plane.snapshot().poses[0, 0] > 2.0, contacts == []) == (passes, passes)


def test_two_bars_head_on_and_side_by_side():
    plane = world([(-1.5, 0.0, 0.0), (1.5, 0.0, np.pi)], bar())
    assert run(plane, 3.0, (1.0, 0, 0), (1.0, 0, 0), check=no_overlap) == [(0, 1)]
    assert plane.snapshot().poses[1, 0] - plane.snapshot().poses[0, 0] == pytest.approx(1.2,
                                                                                        abs=1e-3)
    beside = world([(-1.5, 0.0, 0.0), (1.5, 0.41, np.pi)], bar())
    assert run(beside, 3.0, (1.0, 0, 0), (1.0, 0, 0), check=no_overlap) == []


def test_a_bar_and_a_disc_meet():
    plane = world([(-1.5, 0.0, 0.0), (1.5, 0.0, np.pi)], [bar(), BodyType()])
    assert run(plane, 3.0, (1.0, 0, 0), (1.0, 0, 0), check=no_overlap) == [(0, 1)]
    x = plane.snapshot().poses[:, 0]
    assert x[1] - x[0] == pytest.approx(0.6 + 0.26, abs=1e-3)
    beside = world([(-1.5, 0.0, 0.0), (1.5, 0.47, np.pi)], [bar(), BodyType()])
    assert run(beside, 3.0, (1.0, 0, 0), (1.0, 0, 0), check=no_overlap) == []


def test_a_bar_that_turns_pushes_its_neighbour_aside():
    plane = world([(0.0, 0.0, 0.0), (0.0, 0.5, 0.0)], bar())
    assert run(plane, 1.0, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), check=no_overlap) == [(0, 1)]
    assert plane.snapshot().poses[1, 1] > 0.55


def test_a_moving_obstacle_is_met_by_the_side():
    movers = (MovingObstacle(path=(("0 m", "-3 m"), ("0 m", "3 m")), speed="0.0001 m/s"),)
    plane = world([(0.0, 0.0, 0.0)], bar(), Environment(terrain=square().terrain,
                                                        moving_obstacles=movers))
    assert run(plane, 4.0, (0.0, 0.0, 0.0)) == []
    met = world([(0.0, -2.0, np.pi / 2)], bar(drive="holonomic"), Environment(
        terrain=square().terrain, moving_obstacles=movers))
    assert run(met, 3.0, (-1.0, 0.0, 0.0)) == [(0, -1)]
    assert met.snapshot().poses[0, 1] == pytest.approx(-3.0 + 0.3 + 0.6, abs=0.01)


def test_a_polygon_of_64_corners_behaves_as_its_disc():
    """Through a crowded room, command by command; the corners lie 0.3 mm inside of the circle."""
    starts = [(-3.0, 0.0, 0.3), (3.0, 0.2, 3.0), (0.0, -3.0, 1.5)]
    room = square(10, walls=[{"from": ("-1 m", "0 m"), "to": ("1 m", "1 m")}])

    def ways(body):
        plane, history = world(starts, body, room), []
        contacts = run(plane, 5.0, (0.6, 0.0, 0.1), (0.6, 0.0, -0.05), (0.6, 0.0, 0.0),
                       check=lambda plane: history.append(plane.snapshot().poses[:, :2]))
        return contacts, np.array(history)
    (contacts, disc), (met, many) = ways(BodyType()), ways(regular(64))
    assert contacts == met and contacts
    assert np.abs(disc - many).max() < 0.01
    few = ways(regular(3))[1]
    assert np.abs(disc - few).max() > 0.05, "a triangle is no disc"


@pytest.fixture(scope="module")
def rough(tmp_path_factory):
    """A map_server terrain of 10 m with pillars."""
    folder = tmp_path_factory.mktemp("rough")
    row, col = np.mgrid[:50, :50]
    solid = ((row < 3 + 1.5 * np.sin(col)) | (row > 46) | (col < 2) | (col > 47)
             | ((row % 17 < 2) & (col % 15 < 3)))
    Image.fromarray(np.where(solid, 0, 254).astype(np.uint8)).save(folder / "map.pgm")
    (folder / "map.yaml").write_text("image: map.pgm\nresolution: 0.2\norigin: [0, 0, 0]\n"
                                     "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n")
    return Environment(terrain=MapFile(map=str(folder / "map.yaml"), offset=("-5 m", "-5 m")))


def jostle(environment, seed, seconds=4.0):
    """Bars, triangles and discs at full speed in random directions that change now and then."""
    more = {"drive": "holonomic", "max_speed": "1 m/s", "max_turn": "2 rad/s"}
    bodies = [bar(1.0, 0.4, **more), regular(3, 0.4, **more), BodyType(**more)] * 2
    plane = world([(-3.0 + 2.3 * (i % 3), -1.5 + 3 * (i // 3), 0.0) for i in range(6)], bodies,
                  environment, snap=True)
    random = np.random.default_rng(seed)
    wanted = random.uniform(-1, 1, (10, 6, 3)) * (3.0, 3.0, 2.0)
    run(plane, seconds, *((lambda k, i=i: wanted[k // 40 % 10, i]) for i in range(6)),
        check=no_overlap, every=7)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_nobody_is_ever_in_a_wall_or_in_another(seed):
    jostle(square(10, walls=[{"from": ("-2 m", "-3 m"), "to": ("3 m", "0.3 m")},
                             {"from": ("0 m", "4 m"), "to": ("0 m", "2 m")}],
                  rectangles=[{"x": ("-4 m", "-3 m"), "y": ("-5 m", "-3 m")}]), seed)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_nor_on_a_raster(rough, seed):
    jostle(rough, seed)


def test_the_check_sees_an_overlap():
    """The twin of the two above."""
    plane = world([(0.0, 0.0, 0.0), (0.0, 2.0, 0.0)], bar())
    plane._bodies.poses[1, 1] = 0.35
    plane._snapshot = None
    with pytest.raises(AssertionError):
        no_overlap(plane)


def test_low_walls_are_driven_over_by_polygons_too():
    low = square(walls=[{"from": ("2 m", "-10 m"), "to": ("2 m", "10 m"), "height": "0.05 m"}])
    plane = world([(0.0, 0.0, 0.0)], bar(clearance="0.1 m"), low)
    assert run(plane, 4.0, (1.0, 0.0, 0.0)) == []
    assert run(world([(0.0, 0.0, 0.0)], bar(), low), 4.0, (1.0, 0.0, 0.0)) == [(0, -1)]


def test_a_corner_too_fast_for_the_tick_is_refused():
    with pytest.raises(InputError) as caught:
        world([(0.0, 0.0, 0.0)], bar(3.0, 0.2))
    assert str(caught.value) == (
        "physics.rate: at 9.07745 m/s a corner of robot_0 covers 0.151291 m in a tick and could "
        "pass through walls; allowed: half its inscribed radius (0.05 m)")


def test_a_door_waits_for_the_circle_around_a_bar():
    door = Environment(terrain=square().terrain, doors=(
        Door(**{"from": ("0 m", "-1 m"), "to": ("0 m", "1 m")}, open=(("0 s", "1 s"),)),))
    plane = world([(-0.5, 0.0, np.pi / 2)], bar(), door)
    run(plane, 2.0, (0.0, 0.0, 0.0))
    assert len(plane.obstacles().segments) == 4, "0.3 m beside it, but it may turn"
    assert run(plane, 3.0, (1.0, 0.0, 0.0)) == []
    assert len(plane.obstacles().segments) == 5


# --------------------------------------------------------------------------------------- starts


@pytest.mark.parametrize(("start", "trouble"), [
    ((9.5, 0.0, 0.0), "(9.5, 0) m lies in a wall or its footprint reaches into one; allowed: a "
                      "free place, or start.snap: true to move it to the nearest one"),
    ((9.5, 0.0, np.pi / 2), None),
    ((0.0, 0.3, 0.0), "(0, 0.3) m is 0.3 m from that of robot_0 at (0, 0) m; allowed: footprints "
                      "that do not overlap, or start.snap: true to move it to the nearest free "
                      "place"),
    ((0.0, 0.41, 0.0), None),
    ((0.0, 0.41, np.pi / 2), "(0, 0.41) m is 0.41 m from that of robot_0"),
    ((3.0, 3.1, 0.0), "(3, 3.1) m lies in a wall or its footprint reaches into one"),  # a block
    ((3.0, 3.1, np.pi / 2), None)])
def test_a_start_is_free_where_the_footprint_is(start, trouble):
    block = square(rectangles=[{"x": ("3.3 m", "3.5 m"), "y": ("3 m", "3.2 m")}])
    starts = [(0.0, 0.0, 0.0), start]
    if trouble is None:
        plane = world(starts, bar(), block)
        assert run(plane, 0.1, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)) == []
    else:
        with pytest.raises(InputError) as caught:
            world(starts, bar(), block)
        assert str(caught.value).startswith(
            f"fleet.start: the start of robot_1 at {trouble}")


@pytest.mark.parametrize("disc_first", [True, False])
def test_a_bar_may_start_beside_a_disc(disc_first):
    bodies = [BodyType(), bar()][::1 if disc_first else -1]
    world([(0.0, 0.0, 0.0), (0.0, 0.47, 0.0)], bodies)
    with pytest.raises(InputError, match="footprints that do not overlap"):
        world([(0.0, 0.0, 0.0), (0.0, 0.45, 0.0)], bodies)


def test_drawn_and_moved_starts_have_room_to_turn():
    narrow = Environment(terrain=Shape(size=("6 m", "1.4 m")))
    plane = world([(0.0, 0.6, 0.0), (0.1, 0.6, 0.0)], bar(), narrow, snap=True)
    drawn = world([(math.nan,) * 3] * 2, bar(), narrow, drawn=StartRandom(apart="0.5 m"))
    for found in (plane.snapshot().poses, drawn.snapshot().poses):
        assert point_distance(found[:, :2], plane.terrain.walls).min() > math.hypot(0.6, 0.2) - 1e-6
        assert math.dist(found[0, :2], found[1, :2]) > 2 * math.hypot(0.6, 0.2) - 1e-6


# --------------------------------------------------------------------------------------- lasers


LASER = Laser(beams=721, field_of_view="360 deg", max_range="8 m")


def scan(plane, robot=0, laser=0):
    snapshot = plane.snapshot()
    return plane.scan(snapshot, np.array([robot]), 0, laser)[0]


def test_a_laser_sees_the_sides_of_a_bar():
    """Straight ahead the end of a bar, and its side once it has turned."""
    for yaw, ahead_m in ((0.0, 2.4), (np.pi / 2, 2.8), (np.pi, 2.4)):
        plane = world([(0.0, 0.0, 0.0), (3.0, 0.0, yaw)], bar(), lasers={"scan": LASER})
        assert scan(plane)[360] == pytest.approx(ahead_m, abs=1e-5)
    plane = world([(0.0, 0.0, 0.0), (3.0, 0.0, np.pi / 4)], bar(), lasers={"scan": LASER})
    assert scan(plane)[360] == pytest.approx(3.0 - 0.2 * math.sqrt(2), abs=1e-5)


def to_polygon(x, y, angles, corners):
    """The way along each ray to the polygon, inf where there is none. Brute force."""
    ux, uy = np.cos(angles)[:, None], np.sin(angles)[:, None]
    a, b = corners, np.roll(corners, -1, axis=0)
    ex, ey = (b - a).T
    with np.errstate(divide="ignore", invalid="ignore"):
        across = ux * ey - uy * ex
        t = ((a[:, 0] - x) * ey - (a[:, 1] - y) * ex) / across
        s = ((a[:, 0] - x) * uy - (a[:, 1] - y) * ux) / across
    return np.where((s >= 0) & (s <= 1) & (t > 0), t, np.inf).min(axis=1)


@settings(max_examples=30, deadline=None)
@given(convex(), st.floats(2.0, 4.0), st.floats(-3.1, 3.1), st.floats(-3.1, 3.1),
       st.floats(-3.1, 3.1))
def test_a_laser_sees_any_polygon(corners, away_m, bearing, yaw, own_yaw):
    assume(polygon(corners).inscribed_radius_m > 0.05)
    x, y = away_m * math.cos(bearing), away_m * math.sin(bearing)
    plane = world([(0.0, 0.0, own_yaw), (x, y, yaw)],
                  [bar(), polygon(corners, max_speed="0.1 m/s", max_turn="0.1 rad/s")],
                  lasers={"scan": LASER})
    found = scan(plane)
    angles = own_yaw + np.linspace(-np.pi, np.pi, 721)
    wanted = np.minimum(to_polygon(0.0, 0.0, angles, turned(corners, x, y, yaw)), 8.0)
    off = np.abs(found - wanted) > 1e-4
    assert off.sum() <= 2 * len(corners), "but for beams that graze a corner"
    assert (wanted < 8.0).any()


def test_it_does_not_see_itself_and_is_seen_by_all_in_one_call():
    plane = world([(0.0, 0.0, 0.0), (3.0, 0.0, 0.0), (0.0, 3.0, 0.0)], bar(),
                  lasers={"scan": LASER})
    together = plane.scan(plane.snapshot(), np.arange(3), 0)
    for robot in range(3):
        assert (together[robot] == scan(plane, robot)).all()
        assert together[robot].min() > 0.6
    alone = world([(0.0, 0.0, 0.0)], bar(), lasers={"scan": LASER})
    assert (scan(alone) == 8.0).all()


def test_what_is_lower_than_a_laser_is_not_seen():
    low = bar(height="0.1 m")
    high = LASER.model_copy(update={"height_m": 0.5})
    specs = [RobotSpec("robot_0", bar(), 0.0, 0.0, 0.0, lasers={"scan": high}),
             RobotSpec("robot_1", low, 3.0, 0.0, 0.0, lasers={
                 "scan": LASER.model_copy(update={"height_m": 0.05})})]
    plane = Plane(square(), specs, Fraction(60), Streams(1))
    assert scan(plane)[360] == 8.0
    assert scan(plane, 1)[0] == pytest.approx(2.4, abs=1e-5), "the low one sees the high one"


def test_a_bar_of_64_corners_is_seen_as_a_disc():
    seen = [scan(world([(0.0, 0.0, 0.0), (2.0, 0.5, 0.4)], [BodyType(), body],
                       lasers={"scan": LASER})) for body in (BodyType(), regular(64))]
    meets = np.maximum(*seen) < 8.0
    assert meets.sum() > 20 and np.abs(seen[0] - seen[1])[meets].max() < 0.02


def test_outlines_of_a_mixed_fleet_know_their_own_sides():
    outlines = Outlines([bar(), BodyType(), regular(3)])
    assert outlines.first.tolist() == [0, 4, 4, 7]
    sides = outlines.sides(np.array([(1.0, 2.0, 0.0), (0.0, 0.0, 0.0), (5.0, 5.0, 1.0)]))
    assert sides[:, 2:].tolist() == sides[[1, 2, 3, 0, 5, 6, 4], :2].tolist()
