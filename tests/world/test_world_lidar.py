"""The laser against independent brute force in plain numpy."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from desim.engine.streams import Streams
from desim.ports import Snapshot
from desim.scenario.schema.environment import Door, Environment, MovingObstacle, People, Shape
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.robot import Laser
from desim.world.fleet import RobotSpec
from desim.world.lidar import Lidar
from desim.world.outlines import Outlines
from desim.world.plane import Plane
from desim.world.scene import Scene
from desim.world.terrain import Raster, from_raster

DISC = Outlines([BodyType()])
EXACT_M = 1e-4  # float32 of 26 m; the promise is 1 cm


def plane(environment=None, fleet=((-36.0, 36.0),), laser=None, seed=1):
    specs = [RobotSpec(f"robot_{i + 1}", BodyType(), x, y, 0.0, lasers={"scan": laser or Laser()})
             for i, (x, y) in enumerate(fleet)]
    return Plane(environment or Environment(terrain="maze"), specs, Fraction(60),
                 Streams(seed))


def bare(terrain):
    """The terrain alone."""
    return Scene(terrain.lines, np.full(len(terrain.lines), 2.0), len(terrain.lines),
                 np.zeros((0, 3)), 0, ())


def low_wall(laser_m, others_m=0.24):
    """A robot that looks along x, with another one at 1.5 m, a wall of 0.3 m at 3 m, a door of
    0.5 m at 5 m, and the terrain's end at 10 m; the other carries no laser that counts."""
    shape = Shape(size=("20 m", "20 m"), walls=[
        {"from": ("3 m", "-5 m"), "to": ("3 m", "5 m"), "height": "0.3 m"}])
    door = Door.model_validate({"from": ("5 m", "-5 m"), "to": ("5 m", "5 m"), "height": "0.5 m"})
    specs = [RobotSpec(name, BodyType(height=f"{top} m"), x, 0.0, 0.0,
                       lasers={"scan": Laser(beams=3, field_of_view="180 deg",
                                             height=f"{height} m")})
             for name, x, top, height in (("robot_0", 0.0, 0.24, laser_m),
                                          ("robot_1", 1.5, others_m, 0.1))]
    world = Plane(Environment(terrain=shape, doors=(door,)), specs, Fraction(60), Streams(1))
    return float(world.scan(world.snapshot(), np.array([0]), 0)[0, 1])


@pytest.mark.parametrize(("laser_m", "seen_m"), [
    (0.2, 1.24), (0.24, 1.24), (0.25, 3.0), (0.299, 3.0), (0.3, 5.0), (0.5, 10.0), (3.0, 10.0)])
def test_a_laser_looks_over_what_is_lower(laser_m, seen_m):
    assert low_wall(laser_m) == pytest.approx(seen_m, abs=EXACT_M)
    assert low_wall(laser_m, others_m=4.0) == pytest.approx(1.24, abs=EXACT_M)


def person_ahead(laser_m):
    """The range ahead of a robot that looks at a person 3 m away, before a moving obstacle at 6 m.
    """
    environment = Environment(
        terrain=Shape(size=("20 m", "20 m")),
        people=[People(count=1, path=(("3 m", "-5 m"), ("3 m", "5 m")), width="0 m")],
        moving_obstacles=[MovingObstacle(path=(("6 m", "0 m"), ("6 m", "9 m")), radius="0.3 m")])
    world = plane(environment, [(0.0, 0.0)], Laser(beams=3, field_of_view="180 deg",
                                                   height=f"{laser_m} m"))
    world._crowd.walkers.places[:] = 3.0, 0.0
    discs = np.concatenate([world._movers.discs, world._crowd.discs])
    scene = world.snapshot().geometry._replace(discs=discs)
    return float(world.scan(world.snapshot()._replace(geometry=scene), np.array([0]), 0)[0, 1])


@pytest.mark.parametrize(("laser_m", "seen_m"), [(0.2, 2.75), (1.69, 2.75), (1.7, 5.7)])
def test_a_laser_looks_over_people(laser_m, seen_m):
    assert person_ahead(laser_m) == pytest.approx(seen_m, abs=EXACT_M)


def test_of_people_who_are_too_tall_a_laser_sees_more(monkeypatch):
    """The twin."""
    monkeypatch.setattr("desim.world.people.HEIGHT_M", 1.9)
    assert person_ahead(1.7) == pytest.approx(2.75, abs=EXACT_M)


def directions(laser, yaw):
    angles = yaw - laser.field_of_view_rad / 2 + np.arange(laser.beams) * (
        laser.field_of_view_rad / (laser.beams - 1))
    return np.cos(angles), np.sin(angles)


def to_walls(x, y, ux, uy, walls, reach):
    """Every beam against every wall: solve p + t u = a + s e for t >= 0, 0 <= s <= 1."""
    ax, ay = walls[:, 0] - x, walls[:, 1] - y
    ex, ey = walls[:, 2] - walls[:, 0], walls[:, 3] - walls[:, 1]
    det = ux[:, None] * ey - uy[:, None] * ex
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (ax * ey - ay * ex) / det
        s = (ax * uy[:, None] - ay * ux[:, None]) / det
    t = np.where((np.abs(det) > 1e-14) & (t >= 0) & (s >= 0) & (s <= 1), t, np.inf)
    return np.minimum(t.min(axis=1, initial=np.inf), reach)


def to_discs(x, y, ux, uy, discs, ranges):
    for cx, cy, radius in discs:
        b = ux * (cx - x) + uy * (cy - y)
        square = b * b - ((cx - x) ** 2 + (cy - y) ** 2 - radius**2)
        t = b - np.sqrt(np.maximum(square, 0.0))
        ranges = np.where((square >= 0) & (t >= 0), np.minimum(ranges, t), ranges)
    return ranges


def seen_from(snapshot, *poses):
    """The snapshot with other poses."""
    return Snapshot(snapshot.time_ns, np.array(poses, dtype=float), snapshot.geometry)


def agree(found, exact, share=0.01):
    """Equal, but for the rare beam that passes a corner within rounding on the other side."""
    assert found.shape == exact.shape
    assert (np.abs(found - exact) > EXACT_M).mean() <= share


MAZE = plane(fleet=((-36.0, 36.0), (36.0, -36.0)))
coordinate = st.floats(-39.5, 39.5)
angle = st.floats(-3.2, 3.2)


@settings(max_examples=200, deadline=None)
@given(coordinate, coordinate, angle, st.floats(0.6, 20.0), angle)
def test_walls_and_robots_of_the_maze_are_where_geometry_has_them(x, y, yaw, apart, bearing):
    assume(MAZE.terrain.clearance(np.array([[x, y]]), 1.0)[0] > 0.02)  # no body gets closer
    other = (x + apart * np.cos(bearing), y + apart * np.sin(bearing), 0.0)
    found = MAZE.scan(seen_from(MAZE.snapshot(), (x, y, yaw), other), np.array([0]), 0)[0]
    ux, uy = directions(Laser(), yaw)
    exact = to_walls(x, y, ux, uy, MAZE.terrain.walls, 26.0)
    agree(found, to_discs(x, y, ux, uy, [(*other[:2], 0.26)], exact).astype(np.float32))


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(coordinate, coordinate, coordinate, coordinate), min_size=1, max_size=12),
       angle, st.sampled_from([2, 3, 180, 361]), st.sampled_from([0.5, 3.3161255787892263, 6.28]))
def test_slanted_walls_and_any_field_of_view(rows, yaw, beams, fov):
    rows = [row for row in rows if np.hypot(row[0] - row[2], row[1] - row[3]) > 0.1]
    shape = Shape(size=("80 m", "80 m"), walls=[
        {"from": (f"{a:.6f} m", f"{b:.6f} m"), "to": (f"{c:.6f} m", f"{d:.6f} m")}
        for a, b, c, d in rows])
    laser = Laser(beams=beams, field_of_view=f"{fov!r} rad", max_range="60 m")
    spec = RobotSpec("robot_1", BodyType(radius="0.1 m"), 0.0, 0.0, 0.0, snap=True,
                     lasers={"scan": laser})
    world = Plane(Environment(terrain=shape), [spec], Fraction(60), Streams(1))
    x, y = world.snapshot().poses[0, :2]
    found = world.scan(seen_from(world.snapshot(), (x, y, yaw)), np.array([0]), 0)[0]
    ux, uy = directions(laser, yaw)
    agree(found, to_walls(x, y, ux, uy, world.terrain.walls, 60.0).astype(np.float32),
          share=max(0.01, 1.01 / beams))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**31), angle, st.floats(0.05, 0.6))
def test_beams_over_a_raster_meet_the_sides_of_its_solid_cells(seed, yaw, density):
    solid = np.random.default_rng(seed).random((40, 60)) < density * 0.2
    solid[:, [0, -1]] = solid[[0, -1]] = True
    solid[18:23, 28:33] = False
    terrain = from_raster("raster", Raster(solid, 0.25, -7.0, 3.0), 0, 2.0)
    x, y = -7.0 + 30.37 * 0.25, 3.0 + 20.61 * 0.25
    laser = Laser(beams=91, max_range="9 m")
    lidar = Lidar(laser, 0.35, terrain, np.zeros(0), np.array([0.2]), DISC,
                  np.array([[0.0, 0.35]]), np.array([1], dtype=np.uint64))
    found = lidar.scan(np.array([[x, y, yaw]]), bare(terrain), np.array([0]), 0)
    ux, uy = directions(laser, yaw)
    agree(found[0], to_walls(x, y, ux, uy, terrain.walls, 9.0).astype(np.float32), share=0.02)


def test_beams_along_the_axes_of_a_raster_are_exact():
    solid = np.ones((9, 9), dtype=bool)
    solid[1:8, 1:8] = False
    terrain = from_raster("box", Raster(solid, 1.0, 0.0, 0.0), 0, 2.0)
    laser = Laser(beams=5, field_of_view="360 deg", max_range="20 m")
    lidar = Lidar(laser, 0.35, terrain, np.zeros(0), np.array([0.2]), DISC,
                  np.array([[0.0, 0.35]]), np.array([1], dtype=np.uint64))
    for x, y in ((4.5, 4.5), (4.0, 5.0), (1.25, 7.75)):
        found = lidar.scan(np.array([[x, y, 0.0]]), bare(terrain), np.array([0]), 0)[0]
        np.testing.assert_allclose(found, [x - 1, y - 1, 8 - x, 8 - y, x - 1], atol=1e-5)


def test_nothing_in_reach_reads_the_maximum_range_without_noise():
    world = plane(Environment(terrain=Shape(size=("90 m", "90 m"))), [(0.0, 0.0)],
                  Laser(max_range="26 m", noise="5 cm"))
    assert (world.scan(world.snapshot(), np.array([0]), 3) == np.float32(26.0)).all()


def test_noise_is_a_pure_function_of_name_and_tick():
    quiet = plane()
    loud = plane(laser=Laser(noise="2 cm"))
    more = plane(fleet=((-36.0, 36.0), (36.0, -36.0)), laser=Laser(noise="2 cm"))
    exact = quiet.scan(quiet.snapshot(), np.array([0]), 0)[0]
    ticks = np.stack([loud.scan(loud.snapshot(), np.array([0]), k)[0] for k in range(400)])
    again = more.scan(more.snapshot(), np.array([1, 0]), 7)[1]
    assert (again == ticks[7]).all()
    hit = exact < 25.8
    error = (ticks - exact)[:, hit]
    # 400 ticks x 100 beams or more: 1 % is over two standard errors of the deviation.
    assert abs(error.std() / 0.02 - 1) < 0.01 and abs(error.mean()) < 5e-4
    assert abs(np.corrcoef(error[0], error[1])[0, 1]) < 0.3
    assert ticks.max() <= 26.0


def test_many_robots_in_one_call_equal_one_at_a_time_and_old_snapshots_stay():
    world = plane(fleet=[(-36.0, 36.0 - 2 * i) for i in range(5)])
    first = world.snapshot()
    before = world.scan(first, np.arange(5), 0)
    for i in range(5):
        world.command(i, 1.0, 0.0, 0.5 * i)
    world.advance(10**9)
    assert (world.snapshot().poses != first.poses).any()
    for i in range(5):
        assert (world.scan(first, np.array([i]), 0)[0] == before[i]).all()


def test_a_closed_door_and_a_moving_obstacle_are_seen_in_the_snapshot_that_had_them():
    environment = Environment(
        terrain=Shape(size=("20 m", "20 m")),
        doors=[Door(**{"from": ("4 m", "-3 m"), "to": ("4 m", "3 m"), "open": [("1 s", "2 s")]})],
        moving_obstacles=[MovingObstacle(path=[("0 m", "5 m"), ("0 m", "8 m")], speed="1 m/s",
                                         radius="0.5 m")])
    world = plane(environment, [(0.0, 0.0)], Laser(beams=3, field_of_view="180 deg"))
    ahead, left = (lambda s: world.scan(s, np.array([0]), 0)[0, 1]), (
        lambda s: world.scan(s, np.array([0]), 0)[0, 2])
    closed = world.snapshot()
    world.advance(1_500_000_000)
    opened = world.snapshot()
    world.advance(2_500_000_000)
    assert [ahead(s) for s in (closed, opened, world.snapshot())] == pytest.approx([4, 10, 4])
    assert left(closed) == pytest.approx(4.5)
    assert left(opened) == pytest.approx(6.0, abs=1e-4)
    assert world.obstacles().epoch == 2


