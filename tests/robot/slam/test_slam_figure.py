"""The picture of a log in which the laser met nothing."""

import numpy as np

from desim.imports.slam_logs.slam_trial import SlamTrial
from desim.report.slam_figure import draw_slam
from desim.robot.slam.particle_filter import GridMap


def test_a_map_without_a_known_cell_has_a_picture(tmp_path):
    nothing = GridMap(np.full((8, 8), -1, np.int8), (0.0, 0.0), 0.05)
    one = np.zeros((1, 3))
    draw_slam(SlamTrial(one, one, np.array([True]), 0, np.zeros(1), 1, nothing), "empty",
              tmp_path / "empty.png")
    assert (tmp_path / "empty.png").stat().st_size > 0
