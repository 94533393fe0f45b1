"""The noise of odometry that SLAM reckons with, and that of robots which drive with it."""

import numpy as np
import pytest

from desim.robot.slam.settings import OdometryNoise

READINGS, FORWARD = 100, np.array([3.0, 0.0, 0.0])


def test_errors_of_the_heading_drive_a_robot_aside():
    """20,000 robots drive 3 m in 100 readings, each of which errs in heading by 0.01 rad."""
    errors_rad = np.random.default_rng(1).normal(0.0, 0.01, (20_000, READINGS))
    headings_rad = errors_rad.cumsum(axis=1)
    aside_m = (3.0 / READINGS * headings_rad).sum(axis=1)
    along, across, turned = OdometryNoise(
        0.0, 0.0, 0.0, 0.0, 0.0, 0.0, reading_rad=0.01).sigmas(FORWARD, READINGS)
    assert along == 0.0
    assert across == pytest.approx(aside_m.std(), rel=0.03)
    assert turned == pytest.approx(headings_rad[:, -1].std(), rel=0.03)


@pytest.mark.parametrize("motion, expected", [
    ((3.0, 4.0, 0.0), (0.02 + 0.5, 0.02 + 0.5, 0.01 + 0.5)),
    ((0.0, 0.0, -0.5), (0.02 + 0.05, 0.02 + 0.05, 0.01 + 0.1)),
    ((0.0, 0.0, 0.0), (0.02, 0.02, 0.01))])
def test_noise_grows_with_the_way_and_the_turn(motion, expected):
    assert OdometryNoise().sigmas(np.array(motion), 7) == pytest.approx(expected)
