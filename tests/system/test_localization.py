"""The effect of a robot's error about its place on its map."""

import numpy as np
import pytest
from runs import HELLO, built, finished, outcome_of

from desim.monitor.meters.localization_errors import ClosureErrors
from desim.monitor.summary import summarize
from desim.robot.localization.node import LocalizationNode
from desim.robot.slam.particle_filter import ParticleSlam
from desim.robot.transforms import compose, motion_between
from desim.units import NS_PER_S as S

ODOMETRY, WALK = "robot.localization=odometry", "robot.odometry.model=random_walk"


def wrong_cells(*overrides: str) -> int:
    simulation = built(HELLO, "stop.elapsed=20 s", "stop.explored=100 %", *overrides)
    finished(simulation)
    return summarize(simulation.monitor, simulation.kernel.now_ns)["map_error_cells"]


def test_errors_of_odometry_come_into_the_map_and_drift_does_more_of_it():
    exact, noisy, drifting = wrong_cells(), wrong_cells(ODOMETRY), wrong_cells(ODOMETRY, WALK)
    assert exact < 10
    assert noisy > 100
    assert drifting > 1.5 * noisy


def test_odometry_that_nobody_reads_spoils_nothing():
    assert wrong_cells(WALK) == wrong_cells()


def errors(kind: str, *overrides: str) -> dict[str, object]:
    simulation = built(HELLO, "stop.elapsed=30 s", "stop.explored=100 %",
                       f"robot.localization={kind}", *overrides)
    finished(simulation)
    return summarize(simulation.monitor, simulation.kernel.now_ns)


@pytest.mark.parametrize("kind", ["gmapping", "scan_matching"])
@pytest.mark.parametrize("model", [(), (WALK,)], ids=["independent", "random_walk"])
def test_slam_corrects_what_odometry_spoils(kind, model):
    found, raw = errors(kind, *model), errors("odometry", *model)
    assert found["ate_m"] < 0.1
    assert found["heading_rms_rad"] < 0.005
    assert found["map_error_cells"] < 0.5 * raw["map_error_cells"]
    assert raw["ate_m"] is None  # nobody else says where it takes a scan from


def test_slam_that_does_not_match_scans_is_no_better_than_odometry(monkeypatch):
    monkeypatch.setattr(ParticleSlam, "_move", expected_alone)
    assert errors("scan_matching", WALK)["ate_m"] > 0.15


def expected_alone(slam, odometry, fewer, kept):
    """The twin: particles go where odometry says."""
    slam.poses = compose(slam.poses, motion_between(slam.history[-1].odometry, odometry))
    slam._lineage = np.arange(len(slam.poses))


def test_a_run_with_slam_is_the_same_twice_and_goes_on_after_a_restart():
    def outcome():
        return outcome_of(HELLO, "stop.elapsed=20 s",
                          "robot.localization={model: gmapping, particles: 5}",
                          "faults=[{at: 8 s, host: robot_1, down_for: 3 s}]").digest

    assert outcome() == outcome()


def after_a_restart(kind, at_s=20):
    """Robot 1 stops for five seconds. The scans that its node has drawn just before and two
    seconds after the restart, its first pose and the odometer's then, and the run's summary."""
    simulation = built(HELLO, WALK, "robot.localization=pose_graph", "stop.elapsed=60 s",
                       "stop.by=none",
                       f"faults=[{{kind: {kind}, at: {at_s} s, host: robot_1, down_for: 5 s}}]")
    simulation.graph.start()

    def drawn():
        return list(next(node for node in simulation.graph.host("robot_1").nodes
                         if isinstance(node, LocalizationNode))._drawn)

    simulation.kernel.run(at_s * S - 1)
    before = drawn()
    simulation.kernel.run((at_s + 5) * S)
    world = simulation.world
    odometer = world.odometry(world.snapshot(), world.robots.index("robot_1"), 0)
    simulation.kernel.run((at_s + 7) * S)
    first = drawn()
    simulation.kernel.run(60 * S)
    return before, first, odometer, summarize(simulation.monitor, simulation.kernel.now_ns)


@pytest.mark.parametrize("kind", ["stop", "software"])
def test_a_graph_of_the_team_goes_on_without_a_robot_that_has_started_again(kind):
    """It loses map and graph, and takes the odometer's word for where it is; teammates keep its
    former nodes, and go on closing loops on them."""
    before, first, odometer, summary = after_a_restart(kind)
    assert len(before) > 20 and 1 <= len(first) < 5
    assert np.hypot(first[0].x_m - odometer[0], first[0].y_m - odometer[1]) < 0.05
    assert summary["closures"] > 10 and summary["false_closures"] == 0


def test_closures_on_scans_that_were_forgotten_cannot_be_judged(monkeypatch):
    """The twin: of the robot's former scans none are kept."""
    monkeypatch.setattr(ClosureErrors, "watch", lambda self, robot, robot_map, now_ns:
                        self._drawn.__setitem__(robot, []))
    with pytest.raises(IndexError):
        after_a_restart("stop")
