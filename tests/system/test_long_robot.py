"""A long robot, whole: scenarios/long_robot.yaml, against discs of its two radii."""

import numpy as np
import pytest
from runs import SCENARIOS, audited, built, call_often

from desim.api import recording_of, run
from desim.export.animation.scene import AnimationScene
from desim.monitor.summary import summarize
from desim.report.replay.bundle import bundle
from desim.robot.navigation import situation
from desim.units import NS_PER_S

LONG = SCENARIOS / "long_robot.yaml"
DISC = "fleet.types.long.footprint=null"
DOOR = 0.0  # its walls' x
PASSAGE = -4.0, -3.1, 1.0  # its walls' x, and y where it begins


def played(*overrides):
    """The summary, and [samples, 4]: time s, x m, y m, yaw rad ten times a second."""
    simulation, poses = built(LONG, *overrides), []
    call_often(simulation, lambda: poses.append(
        (simulation.kernel.now_ns / NS_PER_S, *simulation.world.snapshot().poses[0])))
    simulation.run()
    summary = summarize(simulation.monitor, simulation.kernel.now_ns)
    audited(simulation)
    return summary, np.array(poses)


@pytest.fixture(scope="module")
def long():
    return played()


def test_it_gets_through_the_door_and_backs_out_of_the_passage(long):
    summary, poses = long
    assert summary["rounds"] == 2 and summary["collisions"] == 0
    _, x, y, yaw = poses.T
    assert x.max() > 3.5, "it has passed the door"
    inside = (x > PASSAGE[0]) & (x < PASSAGE[1]) & (y > PASSAGE[2] + 0.6)
    assert y[inside].max() > 2.6, "it has been at the end of the passage"
    # 0.9 m wide, it lets a bar of 1.2 m x 0.4 m turn by 0.469 rad at most
    assert np.abs(yaw[inside] - np.pi / 2).max() < 0.469
    back = np.diff(y)[inside[:-1] & inside[1:]] < -0.005
    assert 2 * 10 < back.sum() < 40 * 10, "0.1 m/s, heading inwards all the time"


@pytest.mark.parametrize(("radius", "rounds"), [("0.63 m", 0), ("0.2 m", 2)])
def test_neither_of_its_circles_does_the_same(radius, rounds):
    """The circumscribed one gets into neither door nor passage, and the inscribed one turns in the
    passage."""
    summary, poses = played(DISC, f"fleet.types.long.radius={radius}", "stop.elapsed=120 s")
    assert summary["rounds"] == rounds
    if rounds:
        turned = (poses[:, 2] > PASSAGE[2] + 0.6) & (poses[:, 3] < -1.0)
        assert turned.any()
    else:
        assert poses[:, 1].max() < DOOR
        assert not ((poses[:, 1] > PASSAGE[0]) & (poses[:, 1] < PASSAGE[1])
                    & (poses[:, 2] > PASSAGE[2])).any()


def test_the_same_again_is_the_same(long):
    assert (played()[1] == long[1]).all()


def test_a_planner_that_takes_the_robot_for_its_inscribed_circle_collides(monkeypatch):
    """The twin of the first test: it turns against walls."""
    monkeypatch.setattr(situation, "cover", lambda body, cell_m: np.zeros((0, 3)))
    assert played("stop.elapsed=60 s")[0]["collisions"] > 0


def test_pictures_have_its_outline(tmp_path):
    """The replay and the animation, in the passage: longer than it is wide."""
    result = run(LONG, overrides=["stop.elapsed=12 s"], out=tmp_path)
    recording = recording_of(result)
    about, _ = bundle(recording)
    assert about["footprints"] == [((0.6, 0.2), (-0.6, 0.2), (-0.6, -0.2), (0.6, -0.2))]
    scene = AnimationScene(recording)
    _, _, yaw = recording.poses.at(11 * NS_PER_S)[0]
    assert yaw == pytest.approx(np.pi / 2, abs=0.1)
    pixels = np.asarray(scene.picture(11 * NS_PER_S)).astype(int)
    own = np.abs(pixels - np.round(255 * np.array(scene._colours[0]))).max(axis=2) < 12
    rows, columns = (np.ptp(np.flatnonzero(own.any(axis=axis))) for axis in (1, 0))
    px_per_m = 580 / 14
    assert rows == pytest.approx(1.2 * px_per_m, abs=6)
    assert columns == pytest.approx(0.4 * px_per_m, abs=8)
