"""The plane as a whole: odometry, what the network sees, and building from a scenario."""

from fractions import Fraction
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from desim import plugins
from desim.engine.streams import Streams
from desim.errors import InputError
from desim.scenario.load import from_mapping
from desim.scenario.schema.environment import Environment, Shape
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.robot import Odometry
from desim.units import NS_PER_S
from desim.world import obstacles as matter
from desim.world.fleet import RobotSpec
from desim.world.plane import Plane

OPEN = Environment(terrain=Shape(size=("100 m", "100 m")))


def world(odometry, robots=1, seed=1, environment=OPEN):
    specs = [RobotSpec(f"robot_{i}", BodyType(), 0.0, 3.0 * i, 0.5, snap=True,
                       odometry=odometry)
             for i in range(robots)]
    return Plane(environment, specs, Fraction(60), Streams(seed))


def readings(plane, seconds, read=lambda k: True):
    """Odometry of robot 0 at 10 Hz while it drives a circle, and the true poses."""
    found, true = {}, {}
    for k in range(10 * seconds):
        plane.advance(k * NS_PER_S // 10)
        plane.command(0, 1.0, 0.0, 0.4)
        if read(k):
            found[k] = plane.odometry(plane.snapshot(), 0, k)
            true[k] = plane.snapshot().poses[0]
    return found, true


# ---------------------------------------------------------------------------------------- odometry


def test_independent_noise_has_its_deviations_and_no_memory():
    found, true = readings(world(Odometry()), 100)
    error = np.array([found[k] - true[k] for k in found])
    # 1000 readings: 10 % is over four standard errors of the deviation, 0.13 four of a correlation.
    assert error.std(axis=0) == pytest.approx([0.022, 0.022, 0.02], rel=0.1)
    assert np.abs(error.mean(axis=0)).max() < 4 * 0.022 / np.sqrt(1000)
    correlation = np.corrcoef(np.vstack([error.T, np.roll(error, 1, axis=0).T]))
    assert np.abs(correlation - np.eye(6)).max() < 0.13


def test_a_random_walk_drifts_with_the_root_of_the_steps():
    """Standing still: after n ticks the heading is off by sqrt(n) times one tick's deviation."""
    model = Odometry(model="random_walk", position_noise="0.01 m", heading_noise="0.002 rad")
    drift = []
    for seed in range(12):
        plane = world(model, robots=30, seed=seed, environment=OPEN.model_copy(
            update={"terrain": Shape(size=("200 m", "200 m"))}))
        plane.advance(100 * NS_PER_S // 10)
        snapshot = plane.snapshot()
        drift += [plane.odometry(snapshot, i, 100) - snapshot.poses[i] for i in range(30)]
    drift = np.array(drift)
    # 360 robots: 12 % is over three standard errors.
    assert drift[:, 2].std() == pytest.approx(0.002 * 10, rel=0.12)
    assert np.hypot(drift[:, 0], drift[:, 1]).std() < 0.01 * 10 * 1.1
    assert drift[:, :2].std() == pytest.approx(0.01 * 10, rel=0.12)


def test_without_noise_a_walking_odometer_is_right():
    found, true = readings(world(Odometry(model="random_walk", position_noise="0 m",
                                          heading_noise="0 rad")), 20)
    turns = np.array([found[k] - true[k] for k in found])
    np.testing.assert_allclose(turns[:, :2], 0.0, atol=1e-9)
    np.testing.assert_allclose(np.cos(turns[:, 2]), 1.0, atol=1e-12)


@pytest.mark.parametrize("model", ["independent", "random_walk"])
def test_reading_late_rarely_or_never_changes_nothing(model):
    always, _ = readings(world(Odometry(model=model)), 8)
    rarely, _ = readings(world(Odometry(model=model)), 8, lambda k: k % 7 == 3)
    assert all((always[k] == rarely[k]).all() for k in rarely)
    plane, snapshots = world(Odometry(model=model)), {}
    for k in range(80):
        plane.advance(k * NS_PER_S // 10)
        plane.command(0, 1.0, 0.0, 0.4)
        snapshots[k] = plane.snapshot()
    assert all((plane.odometry(snapshots[k], 0, k) == always[k]).all() for k in reversed(range(80)))


@pytest.mark.parametrize("model", ["independent", "random_walk"])
def test_one_more_robot_moves_no_noise(model):
    one, _ = readings(world(Odometry(model=model)), 3)
    two, _ = readings(world(Odometry(model=model), robots=2), 3)
    assert all((one[k] == two[k]).all() for k in one)


@pytest.mark.parametrize("rate", [7, 25, 60])
def test_odometers_tick_at_their_own_rate_whatever_the_base_tick(rate):
    """Reading k sees the last world tick at or before k / rate, with noise number k."""
    noise = {"position_noise": "0 m", "heading_noise": "0.01 rad"}
    plane = world(Odometry(rate=f"{rate} Hz", model="random_walk", **noise))
    drift = []
    for k in range(60):
        plane.advance(k * NS_PER_S // rate)
        drift.append(plane.odometry(plane.snapshot(), 0, k)[2] - plane.snapshot().poses[0, 2])
    assert drift[0] == 0.0 and len(set(drift)) == 60


# ----------------------------------------------------------------------------- what antennas cross


coordinate = st.integers(-20, 20)
row = st.tuples(coordinate, coordinate, coordinate, coordinate)


def crosses(wall, pair):
    """Exact, in integers: do the two segments have a point in common, parallel ones left out?"""
    def side(ax, ay, bx, by, px, py):
        return (bx - ax) * (py - ay) - (by - ay) * (px - ax)
    x1, y1, x2, y2 = wall
    px, py, qx, qy = pair
    if (x2 - x1) * (qy - py) == (y2 - y1) * (qx - px):
        return False
    return (side(px, py, qx, qy, x1, y1) * side(px, py, qx, qy, x2, y2) <= 0
            and side(x1, y1, x2, y2, px, py) * side(x1, y1, x2, y2, qx, qy) <= 0)


@pytest.mark.parametrize("worth_tiles", [0, 1 << 60])
@settings(max_examples=100, deadline=None)
@given(walls=st.lists(row.filter(lambda r: r[:2] != r[2:]), min_size=1, max_size=20),
       pairs=st.lists(row, max_size=20))
def test_crossings_are_exact(worth_tiles, walls, pairs):
    """With an index of walls and without."""
    with patch.object(matter, "_WORTH_TILES", worth_tiles):
        found = matter.crossing(np.array(walls, float), np.array(pairs, float).reshape(-1, 4))
    assert found.tolist() == [[k, w] for k, pair in enumerate(pairs)
                              for w, wall in enumerate(walls) if crosses(wall, pair)]


def test_more_crossings_than_expected_all_fit():
    walls = np.array([(x, -1.0, x, 1.0) for x in range(1000)])
    found = world(Odometry()).obstacles().crossing(walls, np.array([[-1.0, 0.0, 2000.0, 0.0]]))
    assert found[:, 1].tolist() == list(range(1000))


def test_obstacles_of_the_maze():
    plane = world(Odometry(), environment=Environment(terrain="maze"))
    obstacles = plane.obstacles()
    assert obstacles is plane.obstacles() and not obstacles.segments.flags.writeable
    assert len(obstacles.segments) == 60 == len(obstacles.material) == len(obstacles.height_m)
    assert {obstacles.materials[i] for i in obstacles.material} == {"concrete"}
    assert set(obstacles.height_m) == {2.0} and set(obstacles.thickness_m) == {0.2}
    across = np.array([[-36.0, 36.0, 36.0, 36.0], [-36.0, 36.0, -36.0, 0.0]])
    assert [len(obstacles.crossings(across[i:i + 1])) for i in range(2)] == [2, 0]


# -------------------------------------------------------------------------- built from a scenario


def build(**families):
    scenario = from_mapping({"name": "x", **families}).scenario
    return plugins.load("world", scenario.physics.model).build(scenario, Streams(scenario.seed))


def test_the_papers_fleet():
    plane = build(fleet={"size": 30})
    poses = plane.snapshot().poses
    assert plane.robots[:3] == ("robot_0", "robot_1", "robot_2") and len(plane.robots) == 30
    assert poses.tolist() == [[-38.0, 38.0 - 2 * i, 0.0] for i in range(30)]
    assert plane.body(0).max_speed_mps == 1.2
    assert plane.scan(plane.snapshot(), np.arange(30), 0).shape == (30, 180)
    truth, reachable = plane.ground(plane.grid(0.2), range(30))
    assert reachable.sum() == (truth == 0).sum()


def test_groups_lists_and_names():
    poses = [{"x": "1 m", "y": "2 m", "name": "b10"}, {"x": "5 m", "y": "6 m", "name": "a"},
             {"x": "3 m", "y": "4 m", "heading": "90 deg", "name": "b9"}]
    plane = build(fleet={
        "robots": [{"type": "holonomic", "count": 1}, {"type": "tiny", "count": 2}],
        "types": {"tiny": {"radius": "10 cm"}}, "start": {"poses": poses}})
    assert plane.robots == ("a", "b9", "b10")
    assert plane.snapshot().poses[1].tolist() == [3.0, 4.0, np.pi / 2]
    assert [plane.body(i).drive for i in range(3)] == ["holonomic"] + ["differential"] * 2
    assert [plane.body(i).radius_m for i in range(3)] == [0.26, 0.1, 0.1]


def test_errors_begin_with_the_path_of_what_is_wrong():
    with pytest.raises(InputError, match="^fleet.start: the start of robot_0"):
        build(fleet={"start": {"from": ["-40 m", "38 m"]}})
