"""Bodies: motors, arcs, contacts. Terrain is a walled square unless said otherwise."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from desim.engine.streams import Streams
from desim.errors import InputError, ModelError
from desim.scenario.schema.environment import Door, Environment, MapFile, MovingObstacle, Shape
from desim.scenario.schema.fleet import BodyType, StartRandom
from desim.units import NS_PER_S
from desim.world.fleet import RobotSpec
from desim.world.geometry import point_distance
from desim.world.plane import Plane

TICK_NS = NS_PER_S // 60
OVERLAP_M = 0.01  # the promise
HOLONOMIC = BodyType(drive="holonomic")


def square(side=20, **more):
    return Environment(terrain=Shape(size=(f"{side} m", f"{side} m"), **more))


def world(starts, environment=None, body=None, names=None, snap=False):
    specs = [RobotSpec(names[i] if names else f"robot_{i}", body or BodyType(), *start)
             for i, start in enumerate(starts)]
    if snap:  # otherwise they stand where they are told to
        specs = [spec._replace(snap=True) for spec in specs]
    return Plane(environment or square(), specs, Fraction(60), Streams(1))


def run(plane, seconds, command=lambda plane, k: None, check=lambda plane: None):
    """Command and check at every tick; returns the contacts met."""
    first = round(plane.snapshot().time_ns * 60 / NS_PER_S)
    contacts = []
    for k in range(first, first + round(60 * seconds)):
        command(plane, k)
        plane.advance((k + 1) * NS_PER_S // 60)
        contacts += plane.contacts()
        check(plane)
    return contacts


def drive(*velocities):
    """The same velocity again and again: (forward, left, turn) for robot 0, 1, ..."""
    def command(plane, k):
        for robot, velocity in enumerate(velocities):
            plane.command(robot, *velocity)
    return command


def overlap_m(poses, radius=0.26):
    distance = np.hypot(*(poses[:, None, :2] - poses[None, :, :2]).transpose(2, 0, 1))
    np.fill_diagonal(distance, np.inf)
    return 2 * radius - distance.min()


def no_overlap(plane):
    poses = plane.snapshot().poses
    walls = plane._walls if plane.terrain.raster is None else plane.terrain.walls
    assert point_distance(poses[:, :2], walls).min() > 0.26 - OVERLAP_M
    if len(poses) > 1:
        assert overlap_m(poses) < OVERLAP_M


# ------------------------------------------------------------------------------------------ motion


def test_it_speeds_up_within_its_limits_and_stops_when_commands_stop():
    plane = world([(-5.0, 0.0, 0.0)])
    speeds = []
    run(plane, 1.0, drive((9.0, 3.0, 0.0)), lambda p: speeds.append(p.velocities[0, 0]))
    # 2.5 m/s^2 up to 1.2 m/s: 48 % of a second; a differential drive cannot go left.
    expected = np.minimum(2.5 * np.arange(1, 61) / 60, 1.2)
    np.testing.assert_allclose(speeds, expected, rtol=1e-6)
    assert plane.snapshot().poses[0, 1] == 0.0
    speeds.clear()
    run(plane, 1.0, check=lambda p: speeds.append(p.velocities[0, 0]))
    assert speeds[28] == 1.2 and speeds[31] < 1.2 and speeds[-1] == 0.0


@settings(max_examples=50, deadline=None)
@given(st.floats(-1.2, 1.2), st.floats(-3.0, 3.0), st.floats(-3.1, 3.1))
def test_constant_velocities_make_an_exact_arc(v, w, yaw):
    plane = world([(0.0, 0.0, yaw)], body=BodyType(acceleration="1000 m/s^2",
                                                    turn_acceleration="1000 rad/s^2"))
    run(plane, 2.0, drive((v, 0.0, w)))
    x, y, heading = plane.snapshot().poses[0]
    turned = w * 2.0
    if abs(turned) > 1e-3:
        ahead, aside = v / w * np.sin(turned), v / w * (1 - np.cos(turned))
    else:
        ahead, aside = 2.0 * v, v * turned
    assert x == pytest.approx(np.cos(yaw) * ahead - np.sin(yaw) * aside, abs=1e-6)
    assert y == pytest.approx(np.sin(yaw) * ahead + np.cos(yaw) * aside, abs=1e-6)
    assert np.cos(heading - yaw - turned) == pytest.approx(1.0) and -np.pi <= heading <= np.pi
    assert plane.travelled_m()[0] == pytest.approx(abs(v) * 2.0, rel=2e-3, abs=1e-9)


def test_a_holonomic_body_goes_sideways_and_saturates_as_a_vector():
    plane = world([(0.0, 0.0, 0.0)], body=HOLONOMIC)
    run(plane, 2.0, drive((3.0, 4.0, 0.0)))
    assert plane.velocities[0, :2] == pytest.approx([0.72, 0.96])
    x, y, _ = plane.snapshot().poses[0]
    assert y / x == pytest.approx(4 / 3)


def test_ticks_are_those_of_the_base_rate_whoever_asks_when():
    """Physics does not depend on how often the world is asked to go on."""
    often, seldom = (world([(0.0, 0.0, 0.3)]) for _ in range(2))
    for plane in (often, seldom):
        plane.command(0, 1.0, 0.0, 0.7)
    for k in range(1, 1000):
        often.advance(k * 1_234_567)
    seldom.advance(999 * 1_234_567)
    assert often.snapshot().time_ns == seldom.snapshot().time_ns == 73 * NS_PER_S // 60
    assert (often.snapshot().poses == seldom.snapshot().poses).all()


def test_between_ticks_bodies_go_on_along_their_arcs():
    plane = world([(0.0, 0.0, 0.0)])
    run(plane, 1.0, drive((1.0, 0.0, 0.5)))
    now = plane.snapshot()
    between = plane.snapshot_at(now.time_ns + TICK_NS // 2)
    run(plane, 1 / 60, drive((1.0, 0.0, 0.5)))
    halfway = (now.poses + plane.snapshot().poses) / 2
    np.testing.assert_allclose(between.poses, halfway, atol=1e-4)
    assert plane.snapshot_at(plane.snapshot().time_ns) is plane.snapshot()


def test_snapshots_are_read_only_and_one_a_tick():
    plane = world([(0.0, 0.0, 0.0)])
    snapshot = plane.snapshot()
    assert plane.snapshot() is snapshot
    with pytest.raises(ValueError):
        snapshot.poses[0, 0] = 1.0


def test_a_velocity_that_is_not_finite_is_refused():
    with pytest.raises(ModelError, match="robot_0: velocity must be finite"):
        world([(0.0, 0.0, 0.0)]).command(0, float("nan"), 0.0, 0.0)


def test_a_body_too_fast_for_the_tick_is_refused():
    with pytest.raises(InputError, match="physics.rate: at 30 m/s robot_0 covers 0.5 m in a tick"):
        world([(0.0, 0.0, 0.0)], body=BodyType(max_speed="30 m/s"))


# ---------------------------------------------------------------------------------------- contacts


def test_a_wall_stops_and_is_one_collision():
    plane = world([(8.0, 0.0, 0.0)])
    assert run(plane, 4.0, drive((1.2, 0.0, 0.0)), no_overlap) == [(0, -1)]
    assert plane.snapshot().poses[0, 0] == pytest.approx(10.0 - 0.26, abs=1e-6)
    assert plane.velocities[0, 0] < 0.05


def test_a_collision_is_over_after_half_a_second_without_contact():
    plane = world([(9.5, 0.0, 0.0)])

    def bump(apart_s):
        met = run(plane, 1.0, drive((1.0, 0.0, 0.0)))
        met += run(plane, apart_s, drive((-0.5, 0.0, 0.0)))
        return met
    assert bump(0.05) == [(0, -1)]
    assert bump(0.9) == [], "it had been away for less than half a second"
    assert bump(0.1) == [(0, -1)]


def test_it_slides_along_a_wall():
    plane = world([(9.0, 0.0, np.radians(70))])
    run(plane, 4.0, drive((1.0, 0.0, 0.0)), no_overlap)
    x, y, yaw = plane.snapshot().poses[0]
    assert x == pytest.approx(9.74, abs=1e-6) and y > 2.0 and yaw == pytest.approx(np.radians(70))


def test_two_robots_head_on_are_one_collision():
    plane = world([(-1.0, 0.0, 0.0), (1.0, 0.0, np.pi)])
    assert run(plane, 3.0, drive((1.2, 0, 0), (1.2, 0, 0)), no_overlap) == [(0, 1)]
    poses = plane.snapshot().poses
    assert poses[1, 0] - poses[0, 0] == pytest.approx(0.52, abs=1e-3)


def test_thirty_robots_crowd_into_a_corner_without_overlap():
    plane = world([(-8.0 + 3 * (i % 6), -8.0 + 3 * (i // 6), 0.0) for i in range(30)])

    def to_corner(plane, k):
        for robot, (x, y, yaw) in enumerate(plane.snapshot().poses.tolist()):
            bearing = np.arctan2(10 - y, 10 - x) - yaw
            bearing = (bearing + np.pi) % (2 * np.pi) - np.pi
            plane.command(robot, 1.2 * max(np.cos(bearing), 0.0), 0.0, 4.0 * bearing)
    run(plane, 20.0, to_corner, no_overlap)
    assert np.hypot(*(plane.snapshot().poses[:, :2] - 10).T).mean() < 4.0


@pytest.mark.parametrize("acceleration", ["2.5 m/s^2", "1000 m/s^2"])
def test_a_long_queue_pressed_from_both_ends_keeps_its_room(acceleration):
    """At 1000 m/s^2 every robot lurches 2 cm in every tick: more than pushing can take apart, so
    that robots are put back to where they were."""
    corridor = Environment(terrain=Shape(size=("40 m", "0.6 m")))
    plane = world([(-15 + 0.53 * i, 0.0, 0.0 if i < 15 else np.pi) for i in range(30)], corridor,
                  BodyType(acceleration=acceleration))
    run(plane, 3.0, drive(*[(1.2, 0.0, 0.0)] * 30), no_overlap)


@pytest.fixture(scope="module")
def rough(tmp_path_factory):
    """A map_server terrain of 10 m with wavy walls and pillars."""
    folder = tmp_path_factory.mktemp("rough")
    row, col = np.mgrid[:50, :50]
    solid = ((row < 3 + 1.5 * np.sin(col)) | (row > 46 + 1.5 * np.cos(col / 2)) | (col < 2)
             | (col > 47) | ((row % 13 < 2) & (col % 11 < 3)))
    Image.fromarray(np.where(solid, 0, 254).astype(np.uint8)).save(folder / "map.pgm")
    (folder / "map.yaml").write_text("image: map.pgm\nresolution: 0.2\norigin: [0, 0, 0]\n"
                                     "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n")
    return Environment(terrain=MapFile(map=str(folder / "map.yaml"), offset=("-5 m", "-5 m")))


def jostle(environment, seed, drive_kind, seconds=8.0):
    """Eight robots at full speed in random directions that change now and then."""
    starts = [(-3.5 + 2.3 * (i % 4), -1.0 + 2.5 * (i // 4), 0.0) for i in range(8)]
    plane = world(starts, environment, BodyType(drive=drive_kind), snap=True)
    random = np.random.default_rng(seed)
    wanted = np.zeros((8, 3))

    def command(plane, k):
        if k % 40 == 0:
            wanted[:] = random.uniform(-1, 1, (8, 3)) * (3.0, 3.0, 2.0)
        drive(*wanted.tolist())(plane, k)
    run(plane, seconds, command, no_overlap)
    return plane


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["differential", "holonomic"]))
def test_nobody_is_ever_in_a_wall_or_in_another(seed, drive_kind):
    jostle(square(10, walls=[{"from": ("-2 m", "-3 m"), "to": ("3 m", "0.3 m")},
                             {"from": ("0 m", "4 m"), "to": ("0 m", "2 m")}],
                  rectangles=[{"x": ("-4 m", "-3 m"), "y": ("-5 m", "-3 m")}]), seed, drive_kind)


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["differential", "holonomic"]))
def test_nor_on_a_raster(rough, seed, drive_kind):
    jostle(rough, seed, drive_kind)


def test_a_robot_far_away_changes_nothing_for_the_others():
    """Not one bit, whatever its name sorts it to."""
    near = [(-8.0, 0.0, 0.1), (-7.0, 0.05, 3.0), (-7.5, 0.8, -1.5)]
    runs = []
    for far in ((), ("a", "z")):
        names = ["robot_1", "robot_2", "robot_10", *far]
        plane = world([*near, *[(8.0, 2.0 * i, 0.0) for i in range(len(far))]], names=names)
        order = [plane.robots.index(name) for name in names[:3]]
        history = []

        def command(plane, k, order=order):
            for robot in range(len(plane.robots)):
                plane.command(robot, 1.0, 0.0, 2.0 if robot not in order else 0.3)

        run(plane, 4.0, command, lambda p, order=order, history=history: history.append(
            p.snapshot().poses[order].tobytes()))
        runs.append(history)
    assert runs[0] == runs[1]


def test_the_order_of_declaration_changes_nothing():
    starts = {"robot_2": (-1.0, 0.0, 0.0), "robot_10": (0.0, 0.0, 1.0), "robot_1": (1.0, 0.1, 2.0)}
    planes = [world([starts[name] for name in names], names=names)
              for names in (list(starts), list(reversed(starts)))]
    for plane in planes:
        run(plane, 3.0, drive((1.0, 0, 0.5), (1.0, 0, -0.5), (1.0, 0, 0.1)))
    assert planes[0].robots == ("robot_1", "robot_2", "robot_10") == planes[1].robots
    assert (planes[0].snapshot().poses == planes[1].snapshot().poses).all()


# ----------------------------------------------------------------------- doors, moving obstacles


def room(doors=(), movers=()):
    return Environment(terrain=Shape(size=("20 m", "20 m")), doors=doors, moving_obstacles=movers)


DOOR = Door(**{"from": ("2 m", "-3 m"), "to": ("2 m", "3 m"), "open": [("1 s", "3 s")]})


def test_a_closed_door_is_a_wall_and_an_open_one_is_not():
    plane = world([(0.0, 0.0, 0.0)], room([DOOR]))
    assert plane.obstacles().epoch == 0 and len(plane.obstacles().segments) == 5
    assert plane.obstacles().materials[plane.obstacles().material[-1]] == "wood"
    run(plane, 1.0, drive((1.2, 0.0, 0.0)))
    assert len(plane.obstacles().segments) == 4 and plane.obstacles().epoch == 1
    run(plane, 1.9, drive((1.2, 0.0, 0.0)))
    assert plane.snapshot().poses[0, 0] > 2.5
    run(plane, 3.0, drive((-1.2, 0.0, 0.0)))
    assert plane.snapshot().poses[0, 0] == pytest.approx(2.26, abs=1e-6)
    assert plane.obstacles().epoch == 2


def test_a_door_waits_until_nobody_stands_in_it():
    door = DOOR.model_copy(update={"open_ns": ((0, NS_PER_S),)})
    plane = world([(1.2, 0.0, 0.0)], room([door]))
    run(plane, 1.0, drive((0.9, 0.0, 0.0)), no_overlap)
    run(plane, 2.0, drive((0.0, 0.0, 0.0)), no_overlap)
    assert len(plane.obstacles().segments) == 4, "it is due, but a robot stands there"
    run(plane, 2.0, drive((1.0, 0.0, 0.0)), no_overlap)
    assert len(plane.obstacles().segments) == 5


def test_a_moving_obstacle_goes_there_and_back_and_waits_for_robots():
    walker = MovingObstacle(path=[("-4 m", "0 m"), ("4 m", "0 m")], speed="1 m/s", radius="0.3 m")
    plane = world([(0.0, 5.0, 0.0), (8.0, 0.0, np.pi)], room(movers=[walker]))
    places = []
    run(plane, 16.0, check=lambda p: places.append(p.snapshot().geometry.discs[0, 0]))
    assert [max(places), places[-1]] == pytest.approx([4.0, -4.0], abs=0.02)
    assert plane.obstacles().epoch == 0, "discs are not among the segments"

    def gap(plane):
        discs, poses = plane.snapshot().geometry.discs, plane.snapshot().poses
        assert np.hypot(*(poses[1, :2] - discs[0, :2])) > 0.56 - OVERLAP_M
    assert run(plane, 12.0, drive((0, 0, 0), (1.0, 0.0, 0.0)), gap) == [(1, -1)]
    stopped = plane.snapshot().geometry.discs[0, 0]
    run(plane, 1.0, drive((0, 0, 0), (1.0, 0.0, 0.0)), gap)
    assert plane.snapshot().geometry.discs[0, 0] == stopped


@pytest.mark.parametrize("path, complaint", [
    ([("0 m", "0 m"), ("30 m", "0 m")], "path: crosses a wall or leaves the terrain"),
    ([("0 m", "0 m"), ("0 m", "0 m")], "path: the same way point twice in a row"),
])
def test_impossible_paths(path, complaint):
    with pytest.raises(InputError, match=f"^environment.moving_obstacles.0.{complaint}"):
        world([(0.0, 5.0, 0.0)], room(movers=[MovingObstacle(path=path)]))


def drawn(count, seed=1, names=None, apart="0.6 m", **more):
    """Robots at places that their luck draws."""
    start = StartRandom(apart=apart, **more)
    specs = [RobotSpec(name, BodyType(), *[float("nan")] * 3, False, start)
             for name in names or [f"robot_{i}" for i in range(count)]]
    return Plane(square(), specs, Fraction(60), Streams(seed))


def test_drawn_starts_are_free_apart_and_each_robots_own():
    plane = drawn(40, apart="1.5 m", within=[["-9 m", "0 m"], ["9 m", "9 m"]])
    places = plane.snapshot().poses
    no_overlap(plane)
    assert (np.abs(places[:, 0]) <= 9).all() and ((places[:, 1] >= 0) & (places[:, 1] <= 9)).all()
    apart = np.hypot(*(places[:, None, :2] - places[None, :, :2]).transpose(2, 0, 1))
    assert apart[~np.eye(40, dtype=bool)].min() >= 1.5
    assert (drawn(2).snapshot().poses == drawn(3).snapshot().poses[:2]).all(), "one more moves none"
    assert (drawn(2).snapshot().poses != drawn(2, seed=2).snapshot().poses).all()


def test_a_terrain_without_room_says_so():
    with pytest.raises(InputError, match="^fleet.start: no free place for robot_.* among 16384 that"
                       " were drawn, .* robots being placed; allowed: fewer robots, a smaller apart"
                       " than 12 m or a wider within$"):
        drawn(20, apart="12 m")


def test_a_moving_obstacle_covers_at_most_half_its_radius_in_a_tick():
    path = [("-4 m", "0 m"), ("4 m", "0 m")]
    for radius, highest in (("0.3 m", "9 m/s"), ("0.31 m", "9.3 m/s")):
        world([(0.0, 5.0, 0.0)], room(movers=[
            MovingObstacle(path=path, speed=highest, radius=radius)]))
    with pytest.raises(InputError) as caught:
        world([(0.0, 5.0, 0.0)], room(movers=[MovingObstacle(path=path),
                                              MovingObstacle(path=path, speed="30 m/s")]))
    assert str(caught.value) == (
        "environment.moving_obstacles.1.speed: at 30 m/s it covers 0.5 m in a tick and could pass "
        "through robots and closed doors; allowed: half its radius (0.15 m) a tick, at most 9 m/s")


# -------------------------------------------------------------------------------------- placement


@pytest.mark.parametrize("starts, complaint", [
    ([(9.9, 0.0, 0.0)], r"the start of robot_0 at \(9.9, 0\) m lies in a wall or closer to one "
                        "than its radius of 0.26 m; allowed: a free place, or start.snap: true"),
    ([(3.0, 3.0, 0.0)], r"the start of robot_0 at \(3, 3\) m lies in a wall"),
    ([(0.0, 11.0, 0.0)], "robot_0 .* lies outside the terrain; allowed: x between -10 and 10 m"),
    ([(0.0, 0.0, 0.0), (0.0, 0.5, 0.0)], r"robot_1 at \(0, 0.5\) m is 0.5 m from that of robot_0 at"
                                         r" \(0, 0\) m; allowed: at least 0.52 m apart"),
])
def test_starts_that_are_not_free(starts, complaint):
    terrain = square(rectangles=[{"x": ("2 m", "4 m"), "y": ("2 m", "4 m")}])
    with pytest.raises(InputError, match=f"^fleet.start: .*{complaint}"):
        world(starts, terrain)
    if "outside" in complaint:  # the frame of reference is wrong, there is nothing to snap to
        with pytest.raises(InputError, match=f"^fleet.start: .*{complaint}"):
            world(starts, terrain, snap=True)
        return
    plane = world(starts, terrain, snap=True)
    no_overlap(plane)
    assert np.hypot(*(plane.snapshot().poses[:, :2] - np.array(starts)[:, :2]).T).max() < 1.6


def test_legal_starts_stay_when_others_snap_to_near_them():
    plane = world([(9.9, 0.0, 0.0), (9.7, 0.0, 0.0)], snap=True)
    assert plane.snapshot().poses[1].tolist() == [9.7, 0.0, 0.0]
    assert overlap_m(plane.snapshot().poses) <= 0.0


def test_no_free_place_at_all():
    with pytest.raises(InputError, match="fleet.start: no free place for robot_0 with a radius of "
                                         "0.26 m anywhere in terrain 'shape'"):
        world([(0.0, 0.0, 0.0)], Environment(terrain=Shape(size=("0.5 m", "0.5 m"))), snap=True)
