"""``faults: {kind: stuck}``: a robot that does not move, but talks."""

import numpy as np
import pytest
from recorded import made

from desim.api import recording_of
from desim.report.replay.bundle import bundle
from desim.units import NS_PER_S

SETTINGS = ("deployment=field", "stop.elapsed=20 s", "coordination.exchange.period=1 s",
            "robot.localization=odometry")
STUCK = ("faults=[{kind: stuck, at: 5 s, host: robot_1, down_for: 8 s}, "
         "{at: 7 s, host: robot_1, down_for: 1 s}]")
ALONE = "faults=[{kind: stuck, at: 5 s, host: robot_1, down_for: 8 s}]"


@pytest.fixture(scope="module")
def runs(repository, tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    return {what: recording_of(made(repository, folder / what, *SETTINGS, *faults))
            for what, faults in (("stuck", [ALONE]), ("free", []), ("both", [STUCK]))}


def way_mm(recording, robot, from_s, until_s):
    """The way of a robot between two instants."""
    at = (recording.poses.times_ns >= from_s * NS_PER_S) & (
        recording.poses.times_ns <= until_s * NS_PER_S)
    places = recording.poses.xy_mm[at, recording.robots.index(robot)].astype(float)
    return float(np.hypot(*np.diff(places, axis=0).T).sum())


def test_it_brakes_stands_and_drives_again(runs):
    stuck, free = runs["stuck"], runs["free"]
    assert way_mm(stuck, "robot_1", 0, 5) == way_mm(free, "robot_1", 0, 5) > 1000
    assert way_mm(stuck, "robot_1", 7, 13) == 0 and way_mm(stuck, "robot_1", 13, 20) > 1000
    assert way_mm(free, "robot_1", 7, 13) > 500  # the twin
    assert way_mm(stuck, "robot_0", 7, 13) > 500


def test_it_talks(runs):
    sent = [row for row in runs["stuck"].messages.to_pylist()
            if row["source"] == "robot_1" and row["fate"] == "delivered"
            and 7 * NS_PER_S < row["born_ns"] < 13 * NS_PER_S]
    assert {row["destination"] for row in sent} >= {"robot_0", "robot_2"}


def test_it_is_stuck_still_when_its_software_starts_again(runs):
    assert way_mm(runs["both"], "robot_1", 7, 13) == 0
    assert way_mm(runs["both"], "robot_1", 13, 20) > 0


def test_the_replay_says_so(runs):
    about, _ = bundle(runs["both"])
    assert [text for _, kind, text, hosts in about["events"] if hosts == ["robot_1"] and kind in (
        "stuck", "freed", "host_stopped", "host_started")] == [
        "robot_1 is stuck", "robot_1 stops", "robot_1 starts again", "robot_1 is free again"]
