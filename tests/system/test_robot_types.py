"""Fleets of several types of robots: each carries and runs its own."""

from pathlib import Path

import numpy as np
import pytest
from runs import MAZE_8, SCENARIOS, built, call_often, outcome_of

from desim.scenario.load import from_mapping, load
from desim.scenario.resolved import resolved
from desim.scenario.robot_types import equipment_of, strategies_of
from desim.simulation.deployment import plan
from desim.simulation.simulation import Simulation

TWO = {
    "name": "two", "environment": {"terrain": "maze"},
    "fleet": {"robots": [{"type": "scout", "count": 1}, {"type": "mapper", "count": 1}],
              "types": {"scout": {"radius": "0.2 m", "max_speed": "2 m/s", "strategy": "minpos",
                                  "robot": {"laser": {"max_range": "5 m", "rate": "10 Hz"},
                                            "odometry": {"rate": "20 Hz"}}},
                        "mapper": {"max_speed": "0.5 m/s"}}},
    "robot": {"laser": {"beams": 90}}, "stop": {"elapsed": "20 s"}}


def test_a_type_is_laid_over_the_fleet_key_by_key(tmp_path):
    scenario = from_mapping(TWO).scenario
    scout, mapper = equipment_of(scenario)
    assert (scout.first_laser.max_range_m, scout.first_laser.beams) == (5.0, 90)
    assert (mapper.first_laser.max_range_m, mapper.first_laser.beams) == (26.0, 90)
    assert [choice.strategy for choice in strategies_of(scenario)] == ["minpos",
                                                                      "nearest_frontier"]
    file = Path(tmp_path, "again.yaml")
    file.write_text(resolved(scenario, tmp_path))
    assert resolved(load(file).scenario, tmp_path) == file.read_text()


def test_a_type_whose_equipment_says_nothing_of_localization_has_that_of_the_fleet():
    """A key that is not written is the fleet's, and not the default."""
    def models(kind):
        scenario = from_mapping({"name": "types", "robot": {"localization": "gmapping"}, "fleet": {
            "robots": "own", "types": {"own": {"robot": kind}}}}).scenario
        return equipment_of(scenario)[0].localization.model

    assert models({"odometry": {"rate": "20 Hz"}}) == "gmapping"
    assert models({"localization": "odometry"}) == "odometry"  # the twin: what is written counts


def test_each_type_has_its_own_sensors_at_their_own_rates():
    simulation = Simulation(from_mapping(TWO).scenario)
    simulation.run()
    simulation.graph.catch_up()
    published = {name: topic.counts.intended for name, topic in simulation.graph.topics.items()}
    assert [published[f"/robot_{i}/scan"] for i in (0, 1)] == [20 * 10 + 1, 20 * 25 + 1]
    assert [published[f"/robot_{i}/true_pose"] for i in (0, 1)] == [20 * 20 + 1, 20 * 10 + 1]
    snapshot, world = simulation.world.snapshot(), simulation.world
    far = [float(world.scan(snapshot, np.array([i]), 0).max()) for i in (0, 1)]
    assert far[0] <= 5.0 < far[1] <= 26.0


def test_a_type_that_says_what_the_fleet_says_is_the_fleet():
    types = "fleet.types={same: {robot: {laser: {beams: 180}}, strategy: nearest_frontier}}"
    alike = ("fleet.robots=same", types, "stop.elapsed=5 s")
    assert outcome_of(MAZE_8, *alike).digest == outcome_of(MAZE_8, "stop.elapsed=5 s").digest


def ways(*overrides):
    """[samples, robots, 3] the true poses in two_types.yaml, ten a second for 100 s."""
    simulation = built(SCENARIOS / "two_types.yaml", "stop={explored: 100 %, elapsed: 100 s}",
                       *overrides)
    poses = []
    call_often(simulation, lambda: poses.append(simulation.world.snapshot().poses))
    simulation.run()
    return np.array(poses)


def test_the_scout_passes_the_narrow_door_and_the_mapper_does_not():
    scout, mapper = ways()[:, :, 0].max(axis=0)
    assert scout > 7.0
    assert mapper < 6.0
    # the twin: with a body like the scout's, the mapper gets through, too
    assert ways("fleet.types.mapper.radius=0.2 m",
                "fleet.types.mapper.max_speed=1.5 m/s")[:, 1, 0].max() > 6.0


def test_the_mapper_looks_over_the_low_wall_and_the_scout_does_not():
    def beyond(*overrides):
        """Whether each of the robots sees more than 7 m to the east from its start, where the low
        wall is 6 m away."""
        world = built(SCENARIOS / "two_types.yaml", *overrides,
                      "fleet.types.scout.robot.laser.max_range=26 m").world
        return [float(world.scan(world.snapshot(), np.array([i]), 0)[0, 88:92].max()) > 7.0
                for i in (0, 1)]

    assert beyond() == [False, True]
    assert beyond("fleet.types.mapper.robot.lasers.high.height=0.2 m") == [False, False]  # the twin


def test_a_body_drives_over_walls_up_to_its_clearance():
    def driven(clearance):
        world = Simulation(from_mapping({
            "name": "step", "environment": {"terrain": {"size": ["20 m", "20 m"], "walls": [
                {"from": ["2 m", "-9 m"], "to": ["2 m", "9 m"], "height": "0.1 m"}]}},
            "fleet": {"robots": "rover", "types": {"rover": {"clearance": clearance}},
                      "start": {"poses": [{"x": "0 m", "y": "0 m"}]}}}).scenario).world
        for tick in range(1, 300):
            world.command(0, 1.0, 0.0, 0.0)
            world.advance(tick * 10**9 // 60)
        return float(world.snapshot().poses[0, 0]), world.contacts()

    x_m, hit = driven("0.1 m")
    assert x_m > 4.0
    assert hit == []
    x_m, hit = driven("0.09 m")
    assert x_m == pytest.approx(2.0 - 0.26, abs=1e-5)
    assert hit == [(0, -1)]


def flown(altitude, *poses, **other):
    """The x of robot_0 after 5 s, and its contacts; a wall 1 m high is at x = 2 m, others
    stand at these ``poses`` along the way."""
    types = {"flyer": {"drive": "aerial", "altitude": altitude}, "rover": other}
    world = Simulation(from_mapping({
        "name": "flight", "environment": {"terrain": {"size": ["20 m", "20 m"], "walls": [
            {"from": ["2 m", "-9 m"], "to": ["2 m", "9 m"], "height": "1 m"}]}},
        "fleet": {"types": types, "robots": [
            {"type": kind, "count": 1} for kind in ("flyer", "rover")[:1 + len(poses)]],
            "start": {"poses": [{"x": f"{x} m", "y": "0 m"} for x in (0.0, *poses)]}}}).scenario
        ).world
    for tick in range(1, 300):
        world.command(0, 1.0, 0.0, 0.0)
        world.advance(tick * 10**9 // 60)
    return float(world.snapshot().poses[0, 0]), world.contacts()


def test_an_aerial_robot_flies_over_walls_up_to_its_altitude():
    x_m, hit = flown("1 m")
    assert (x_m > 4.0, hit) == (True, [])
    x_m, hit = flown("0.9 m")  # the twin
    assert x_m == pytest.approx(2.0 - 0.26, abs=1e-5)
    assert hit == [(0, -1)]


def test_an_aerial_robot_flies_over_robots_that_are_lower():
    over = flown("1 m", 3.0)
    assert (over[0] > 4.0, over[1]) == (True, [])
    into = flown("1 m", 3.0, height="1.1 m")  # the twin
    assert into[0] < 4.0
    assert into[1] == [(0, 1)]


@pytest.mark.parametrize("altitude, seen_m", [("0.6 m", 2.0), ("0.7 m", 10.0)])
def test_the_laser_is_at_its_altitude(altitude, seen_m):
    """The plane is 0.35 m above it: 0.95 m and 1.05 m high before a wall 1 m high."""
    world = Simulation(from_mapping({
        "name": "laser", "environment": {"terrain": {"size": ["20 m", "20 m"], "walls": [
            {"from": ["2 m", "-9 m"], "to": ["2 m", "9 m"], "height": "1 m"}]}},
        "fleet": {"robots": "flyer", "types": {"flyer": {"drive": "aerial", "altitude": altitude}},
                  "start": {"poses": [{"x": "0 m", "y": "0 m"}]}},
        "robot": {"laser": {"beams": 181}}}).scenario).world
    ranges = world.scan(world.snapshot(), np.array([0]), 0)[0]
    assert float(ranges[90]) == pytest.approx(seen_m, abs=1e-5)


def test_the_antenna_is_at_its_altitude():
    plans = plan(from_mapping({
        "name": "mast", "deployment": "field", "fleet": {
            "robots": "flyer", "types": {"flyer": {"drive": "aerial", "altitude": "3 m", "robot": {
                "antenna": {"height": "0.2 m"}}}}}}).scenario)
    assert [host.antenna.height_m for host in plans] == [pytest.approx(3.2)]


FRONT = {"laser": {"max_range": "5 m"}}


@pytest.mark.parametrize("carried", [
    FRONT, {"lasers": {"front": FRONT["laser"], "rear": {"yaw": "180 deg"}}},
    {"sonar": {}}, {"odometry": {"rate": "7 Hz"}}])
def test_a_robot_has_the_sensors_of_its_type_alone_where_each_has_its_own_driver(carried):
    scenario = from_mapping({
        "name": "field", "deployment": "field", "stop": {"elapsed": "1 s"},
        "robot": {"localization": "odometry"},
        "fleet": {"robots": [{"type": "plain", "count": 1}, {"type": "other", "count": 1}],
                  "types": {"plain": {}, "other": {"robot": carried}}}}).scenario
    simulation = Simulation(scenario)
    world, scanned, ticks = simulation.world, set(), {0: set(), 1: set()}
    scan, odometry = world.scan, world.odometry

    def noted_scan(snapshot, robots, tick, number=0):
        scanned.add((int(robots[0]), number))
        return scan(snapshot, robots, tick, number)

    def noted_odometry(snapshot, robot, tick):
        ticks[robot].add(tick)
        return odometry(snapshot, robot, tick)

    world.scan, world.odometry = noted_scan, noted_odometry
    simulation.run()
    equipment = equipment_of(scenario)
    assert scanned == {
        (robot, number) for robot, own in enumerate(equipment) for number in range(
            len(own.lasers_by_topic) + (0 if own.sonar is None else len(own.sonar.cones)))}
    for robot, own in enumerate(equipment):
        assert own.odometry.rate_hz / 2 < max(ticks[robot], default=0) <= own.odometry.rate_hz
