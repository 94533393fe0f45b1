"""The effect of a robot's error about its place on its map."""

import numpy as np
import pytest
from runs import HELLO, built, finished, outcome_of

from desim.monitor.summary import summarize
from desim.robot.slam.particle_filter import ParticleSlam
from desim.robot.transforms import compose, motion_between

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
