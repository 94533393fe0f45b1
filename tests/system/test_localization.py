"""The effect of a robot's error about its place on its map."""

from runs import HELLO, built, finished

from desim.monitor.summary import summarize

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
