"""The monitor's errors of poses and of walls, on poses and maps by hand."""

import numpy as np
import pytest

from desim.engine.trace import bits
from desim.monitor.meters.localization_errors import LocalizationErrors, wall_errors
from desim.ports import GridSpec
from desim.ports.tasks import Ground
from desim.robot.mapping.tiles import FREE, OCCUPIED

GRID = GridSpec(0.5, 20, 10, 0.0, 0.0)


def ground():
    """One wall, the column 4."""
    solid = np.zeros((10, 20), np.uint8)
    solid[:, 4] = 1
    return Ground(GRID, solid, solid == 0)


def test_errors_of_processed_and_of_online_poses_are_apart():
    errors = LocalizationErrors(("a", "b"), lambda: np.array([[0.0, 0.0, 3.0], [1.0, 1.0, 0.0]]))
    errors.listeners["localized"]("a", bits(0.3), bits(0.4), bits(3.0))
    errors.listeners["localized"]("b", bits(1.0), bits(1.0), bits(0.2))
    errors.listeners["believed"]("a", bits(0.0), bits(2.0), bits(3.1 - 2.0 * np.pi))
    assert errors.summary(0) == pytest.approx({
        "ate_m": 0.5 / 2 ** 0.5, "ate_max_m": 0.5, "heading_rms_rad": 0.2 / 2 ** 0.5,
        "online_ate_m": 2.0, "online_heading_rms_rad": 0.1})


def test_without_slam_there_are_no_errors_of_poses():
    assert set(LocalizationErrors(("a",), lambda: np.zeros((1, 3))).summary(0).values()) == {None}


@pytest.mark.parametrize(("column", "off_m"), [(4, 0.0), (5, 0.5), (2, 1.0)])
def test_a_wall_that_is_off_by_cells_is_off_by_their_width(column, off_m):
    log_odds = np.full((10, 20), FREE, np.int16)
    log_odds[:, column] = OCCUPIED
    assert set(wall_errors(ground(), log_odds).values()) == {off_m}


def test_a_phantom_among_ten_walls_moves_the_percentile_and_not_the_median():
    log_odds = np.full((10, 20), FREE, np.int16)
    log_odds[:, 4] = OCCUPIED
    log_odds[0, 10] = OCCUPIED
    assert wall_errors(ground(), log_odds) == {"wall_error_median_m": 0.0, "wall_error_p95_m": 3.0}
    assert set(wall_errors(ground(), np.full((10, 20), FREE, np.int16)).values()) == {None}
