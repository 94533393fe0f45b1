"""Robots with several lasers, each mounted somewhere else."""

import numpy as np
import pytest
from runs import SCENARIOS, built

import desim
from desim.api import recording_of
from desim.export.ros.laser_scans import Scanner
from desim.export.ros.message_types import RosTypes
from desim.export.ros.topics import topic_messages
from desim.scenario.load import from_mapping, load
from desim.scenario.resolved import resolved
from desim.scenario.robot_types import equipment_of
from desim.simulation.simulation import Simulation

FRONT = {"beams": 3, "field_of_view": "2 deg", "x": "0.2 m", "rate": "25 Hz"}
REAR = {"beams": 3, "field_of_view": "2 deg", "x": "-0.1 m", "y": "0.05 m", "yaw": "180 deg",
        "rate": "10 Hz", "max_range": "12 m"}
NO_LOW = "fleet.types.mapper.robot.lasers.low.height=0.6 m"


def room(lasers, heading="0 deg", **sections):
    """A robot at (1, 2) in a room of 20 m x 10 m about the origin."""
    return from_mapping({
        "name": "room", "environment": {"terrain": {"size": ["20 m", "10 m"]}},
        "fleet": {"start": {"poses": [{"x": "1 m", "y": "2 m", "heading": heading}]}},
        "robot": {"lasers": lasers}, "stop": {"explored": "100 %", "elapsed": "4 s"},
        **sections}).scenario


def middle_m(scenario, number):
    """The range of the middle beam of the robot's laser of this number."""
    world = Simulation(scenario).world
    return float(world.scan(world.snapshot(), np.array([0]), 0, number)[0, 1])


@pytest.mark.parametrize("heading, front_m, rear_m", [("0 deg", 8.8, 10.9), ("90 deg", 2.8, 6.9)])
def test_a_laser_sees_from_where_it_is_mounted(heading, front_m, rear_m):
    lasers = {"front": FRONT, "rear": REAR}
    assert middle_m(room(lasers, heading), 0) == pytest.approx(front_m, abs=1e-5)
    assert middle_m(room(lasers, heading), 1) == pytest.approx(rear_m, abs=1e-5)
    # the twin: not where it would see from the middle
    bare = {"front": {**FRONT, "x": "0 m"}, "rear": {**REAR, "x": "0 m"}}
    assert abs(middle_m(room(bare, heading), 0) - front_m) > 0.1
    assert abs(middle_m(room(bare, heading), 1) - rear_m) > 0.05


def test_each_laser_has_its_own_topic_rate_and_noise():
    noisy = {**FRONT, "noise": "1 cm"}
    simulation = Simulation(room({"front": noisy, "again": noisy, "rear": REAR}))
    simulation.run()
    simulation.graph.catch_up()
    published = {name: topic.counts.intended for name, topic in simulation.graph.topics.items()}
    assert [published[f"/robot_0/{topic}"] for topic in ("scan", "again/scan", "rear/scan")] == [
        4 * 25 + 1, 4 * 25 + 1, 4 * 10 + 1]
    assert published["/robot_0/scan"] == published["/robot_0/again/scan"]
    world = simulation.world
    first, second = (world.scan(world.snapshot(), np.array([0]), 0, i)[0] for i in (0, 1))
    assert (first != second).all()
    # noise goes by the laser's name: one more before it changes nothing
    fewer = Simulation(room({"front": noisy, "again": noisy})).world
    assert (fewer.scan(world.snapshot(), np.array([0]), 0, 1)[0] == second).all()


def test_the_only_laser_and_one_of_a_name_are_the_same():
    """The short form, and the long one of one laser."""
    def digest(robot):
        return Simulation(load(SCENARIOS / "hello.yaml", (
            "stop.elapsed=5 s", f"robot={robot}")).scenario).run().digest

    assert digest("{laser: {beams: 90}}") == digest("{lasers: {only: {beams: 90}}}")
    assert digest("{laser: {beams: 90}}") != digest("{lasers: {only: {beams: 91}}}")  # the twin


def test_a_type_with_several_lasers_in_a_fleet_with_one_and_the_other_way_round(tmp_path):
    def carried(fleet, kind):
        scenario = from_mapping({"name": "types", "robot": fleet, "fleet": {
            "robots": "own", "types": {"own": {"robot": kind}}}}).scenario
        (tmp_path / "again.yaml").write_text(resolved(scenario, tmp_path))
        again = load(tmp_path / "again.yaml").scenario
        assert resolved(again, tmp_path) == (tmp_path / "again.yaml").read_text()
        lasers = equipment_of(scenario)[0].lasers_by_topic
        return {topic: laser.beams for topic, laser in lasers.items()}

    one, two = {"laser": {"beams": 5}}, {"lasers": {"a": {"beams": 6}, "b": "lms500"}}
    assert carried(one, two) == {"scan": 6, "b/scan": 180}
    assert carried(two, one) == {"scan": 5}
    assert carried(two, {"exploration": {"rate": "2 Hz"}}) == {"scan": 6, "b/scan": 180}
    assert carried(one, {"exploration": {"rate": "2 Hz"}}) == {"scan": 5}


@pytest.mark.parametrize("model", ["ground_truth", "scan_matching"])
def test_all_lasers_draw_the_map(model):
    def known_behind(*lasers):
        """Whether the robot's map has the wall behind it; ahead is to the right."""
        wide = {"beams": 91, "field_of_view": "90 deg"}
        given = {"front": wide, "rear": {**wide, "yaw": "180 deg", "x": "-0.2 m"}}
        scenario = room({name: given[name] for name in lasers},
                        robot={"lasers": {name: given[name] for name in lasers},
                               "localization": model, "odometry": {"position_noise": "0 m",
                                                                   "heading_noise": "0 rad"}},
                        stop={"explored": "100 %", "elapsed": "1 s"})
        simulation, maps = Simulation(scenario), []
        simulation._watchers[0].watch = lambda _, robot_map: maps.append(robot_map)
        simulation.run()
        spec, cells = maps[0].spec, maps[0].fused
        column, row = spec.cell(-9.9 - 0.15, 2.0)
        number = row // 32 * maps[0].tiles_x + column // 32
        return cells[number, row % 32 * 32 + column % 32] > 0

    assert known_behind("front", "rear")
    assert not known_behind("front")  # the twin


def collisions(*overrides):
    """In scenarios/two_types.yaml."""
    simulation = built(SCENARIOS / "two_types.yaml", *overrides)
    simulation.run()
    return simulation.monitor.incidents.collisions


def test_a_low_laser_sees_the_low_wall_that_the_high_one_looks_over():
    assert collisions() == 0
    assert collisions(NO_LOW) > 0  # the twin


def test_the_ros_export_has_the_scans_and_frames_of_all_lasers(tmp_path):
    scenario = tmp_path / "two.yaml"
    scenario.write_text("""
name: lasers
robot: {lasers: {front: {beams: 5}, rear: {beams: 7, x: -0.1 m, yaw: 180 deg}}}
stop: {elapsed: 2 s}
""")
    recording = recording_of(desim.run(scenario, out=tmp_path / "results"))
    found = list(topic_messages(recording, RosTypes(2), Scanner(recording.run.scenario)))
    scans = {one.topic: one.message for one in found if one.topic.endswith("scan")}
    assert {topic: (scan.header.frame_id, len(scan.ranges)) for topic, scan in scans.items()} == {
        "/robot_0/scan": ("robot_0/laser", 5), "/robot_0/rear/scan": ("robot_0/rear/laser", 7)}
    fixed = next(one.message for one in found if one.topic == "/tf_static")
    mounts = {one.child_frame_id: (one.transform.translation.x, abs(one.transform.rotation.z))
              for one in fixed.transforms if one.header.frame_id == "robot_0/base_link"}
    assert mounts["robot_0/laser"] == (0.0, 0.0)
    assert mounts["robot_0/rear/laser"] == pytest.approx((-0.1, 1.0))
