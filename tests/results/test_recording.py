"""The recording of a run: what was looked at is what happened."""

from __future__ import annotations

from contextlib import contextmanager

import numpy as np
import pytest
import yaml

import desim
from desim.api import recording_of
from desim.engine.kernel import Phase
from desim.errors import InputError
from desim.monitor.map_growth import NEVER
from desim.results.recording import Poses
from desim.robot.mapping.tiles import FREE, OCCUPIED, raster
from desim.simulation.simulation import Simulation

S = 1_000_000_000
CART = {"path": [["-2 m", "-6 m"], ["4 m", "-6 m"]], "speed": "0.5 m/s", "radius": "0.4 m"}
DOOR = {"from": ["2 m", "2 m"], "to": ["2 m", "4 m"], "open": [["1 s", "3 s"]]}


@pytest.fixture(scope="module")
def scenario(repository, tmp_path_factory):
    """Three robots for eight seconds; one of them stops for two, and a door opens for two."""
    data = yaml.safe_load((repository / "scenarios" / "hello.yaml").read_text())
    data["stop"] = {"elapsed": "8.05 s"}
    data["faults"] = [{"host": "robot_1", "at": "4 s", "down_for": "2 s"}]
    data["environment"] |= {"doors": [DOOR], "moving_obstacles": [CART]}
    file = tmp_path_factory.mktemp("scenario") / "three.yaml"
    file.write_text(yaml.safe_dump(data))
    return desim.load(file, ["fleet.size=3"]).scenario


@pytest.fixture(scope="module")
def recording(scenario, tmp_path_factory):
    return recording_of(desim.run(scenario, out=tmp_path_factory.mktemp("results")))


def test_poses_are_those_of_the_world(scenario, recording):
    simulation = Simulation(scenario)
    simulation.run(5 * S)
    true = simulation.world.snapshot().poses
    assert recording.robots == simulation.world.robots
    assert recording.poses.times_ns.tolist() == [
        *range(0, 8 * S + 1, S // 10), round(8.05 * S)]
    assert np.allclose(recording.poses.at(5 * S), true, rtol=0, atol=0.0005001)
    assert recording.poses.xy_mm.dtype == np.int32 and recording.poses.yaw_mrad.dtype == np.int16


@pytest.mark.parametrize("robots", [0, 1])
def test_the_smallest_fleets_have_poses(repository, tmp_path, robots):
    """Of nobody at the first and the last instant, of one robot every tenth of a second."""
    poses = recording_of(desim.run(
        repository / "scenarios" / "hello.yaml", out=tmp_path,
        overrides=("stop.elapsed=1 s", f"fleet.size={robots}"))).poses
    assert poses.times_ns.tolist() == [*range(0, S + 1, S // 10 if robots else S)]
    assert poses.at(0).shape == (robots, 3)


def test_a_pose_between_two_instants_turns_the_short_way():
    poses = Poses(np.array([0, 100]), np.array([[[0, 0]], [[1000, 500]]], np.int32),
                  np.array([[3100], [-3100]], np.int16))
    x_m, y_m, yaw_rad = poses.at(50)[0].tolist()
    assert (x_m, y_m) == (0.5, 0.25)
    assert abs(yaw_rad) == pytest.approx(np.pi, abs=0.001)
    assert poses.at(-5).tolist() == poses.at(0).tolist()
    assert poses.at(500).tolist() == poses.at(100).tolist()


@pytest.mark.parametrize("until_s", [1, 3])
def test_a_map_has_grown_as_it_was(scenario, recording, until_s):
    simulation = Simulation(scenario)
    simulation.run(until_s * S)
    robot_map = simulation.monitor.maps["robot_0"]
    fused = raster(robot_map.spec, robot_map.fused)
    known = (fused <= FREE) | (fused >= OCCUPIED)
    growth = recording.growths[0]
    tenths = (until_s * S - growth.started_ns) // (S // 10)
    assert growth.robot == "robot_0" and growth.grid == robot_map.spec
    # Cells that became known and were in doubt again count as known.
    assert known.any() and not (known & (growth.known_since > tenths)).any()
    assert (growth.known_since <= tenths).sum() <= 1.05 * known.sum()


def test_software_that_starts_again_has_a_map_of_its_own(recording):
    one, other = (growth for growth in recording.growths if growth.robot == "robot_1")
    assert one.until_ns == 4 * S and other.started_ns == 6 * S
    assert other.until_ns == recording.end_ns
    assert (other.known_since < NEVER).any()
    assert not (one.occupied & (one.known_since == NEVER)).any()


def test_a_door_is_a_wall_while_it_is_closed(recording):
    corners = (2000, 2000, 2000, 4000)
    door = [wall for wall in recording.walls if wall[2:6] == corners]
    assert [(wall.from_ns, wall.until_ns > 8 * S) for wall in door[1:]] == [(3 * S, True)]
    assert door[0].from_ns == 0 and door[0].until_ns == S
    assert all(wall.from_ns == 0 for wall in recording.walls if wall[2:6] != corners)


def test_a_cart_drives_to_and_fro(scenario, recording):
    assert recording.moving_obstacles.shape == (82, 1, 3)
    simulation = Simulation(scenario)
    simulation.run(5 * S)
    true_mm = simulation.world.moving_obstacles() * 1000
    assert np.allclose(recording.moving_obstacles[50], true_mm, rtol=0, atol=0.5001)
    assert recording.moving_obstacles[0].tolist() == [[-2000, -6000, 400]]


def test_goals_and_plans_follow_each_other(recording):
    kinds = {plan.kind for plan in recording.plans}
    assert kinds == {"goal", "plan", "frontiers", "way"}
    times = [plan.time_ns for plan in recording.plans]
    assert times == sorted(times)
    goal = next(plan for plan in recording.plans if plan.kind == "goal")
    seen = [plan for plan in recording.plans if plan.kind == "frontiers"
            and plan.time_ns == goal.time_ns and plan.robot == goal.robot]
    assert goal.xy_mm.tolist()[0] in seen[0].xy_mm.tolist()


def test_events_are_in_words(recording):
    stopped = [event for event in recording.events if event.kind == "host_stopped"]
    assert [(event.time_ns, event.entity) for event in stopped] == [(4 * S, "robot_1")]
    goal = next(event for event in recording.events if event.kind == "goal")
    assert all(abs(float(part)) < 12 for part in goal.detail.split()[:2])  # within 24 m x 24 m
    assert not {"sent", "pose", "sample"} & {event.kind for event in recording.events}


def test_links_and_messages_are_there(recording):
    assert {(change.host, change.other) for change in recording.links} >= {("robot_0", "robot_2")}
    assert recording.messages.num_rows > 0
    assert [host.name for host in recording.hosts][:2] == ["robot_0", "robot_1"]


def test_a_failed_run_keeps_what_was_recorded(scenario, tmp_path):
    def fail(_):
        raise RuntimeError("broken")

    @contextmanager
    def watch(simulation, folder):
        simulation.kernel.at(2 * S, Phase.WORLD, 0, fail)
        yield

    with pytest.raises(RuntimeError):
        desim.run(scenario, out=tmp_path, watch=watch)
    failed = desim.Run(next((tmp_path / "hello").iterdir()))
    recording = recording_of(failed)
    assert (recording.poses.times_ns[-1], recording.end_ns) == (2 * S, 2 * S)
    assert len(recording.growths) == 3 and recording.events


def test_looking_changes_nothing(scenario, recording, tmp_path):
    bare = desim.run(scenario.model_copy(update={"trace": type(scenario.trace)(keep="none")}),
                     out=tmp_path)
    assert bare.manifest["digest"] == recording.run.manifest["digest"]
    assert not bare.has("poses.parquet")
    again = recording_of(bare)
    assert np.array_equal(again.poses.xy_mm, recording.poses.xy_mm)
    assert again.run.manifest["digest"] == bare.manifest["digest"]


def test_a_run_of_other_versions_cannot_be_made_again(scenario, tmp_path, monkeypatch):
    bare = desim.run(scenario.model_copy(update={"trace": type(scenario.trace)(keep="none")}),
                     out=tmp_path)
    bare.manifest["source"] = "0123456789ab"
    with pytest.raises(InputError) as error:
        recording_of(bare)
    assert str(error.value) == (
        f"{bare.path}: its poses and maps were not kept, and it cannot be repeated: source in its "
        "manifest differ from those installed now; run the scenario again (with --set "
        "trace.keep=replay they are kept)")
