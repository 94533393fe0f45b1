"""The authors' maps beside ours: how they are laid on the terrain, and what it takes."""

import subprocess
import sys

import numpy as np
import published_maps
import pytest

from desim.monitor.meters.localization_errors import wall_errors
from desim.ports import GridSpec
from desim.ports.tasks import Ground


@pytest.fixture
def ground():
    """A room with a wall in it, 20 m wide."""
    solid = np.zeros((80, 100), np.uint8)
    solid[[0, -1]] = solid[:, [0, -1]] = solid[30, 20:60] = 1
    return published_maps.with_room(Ground(GridSpec(0.2, 100, 80, 0.0, 0.0), solid, solid == 0))


def walls_of(ground):
    rows, columns = np.nonzero(ground.solid)
    grid = ground.grid
    return np.c_[grid.x_m + 0.2 * (columns + 0.5), grid.y_m + 0.2 * (rows + 0.5)]


def test_a_true_map_that_is_shifted_and_turned_has_no_error(ground):
    true = walls_of(ground)
    x_m, y_m = published_maps.NEAR
    theirs = published_maps.moved(true, true.mean(axis=0), (-x_m + 0.7, -y_m - 0.5, 0.02))
    placed = published_maps.laid_on(ground, theirs)
    assert np.abs(placed.walls_m - true).max() < 0.2  # a cell: they see no more of it
    found = wall_errors(ground, published_maps.as_evidence(ground, placed.walls_m))
    assert found == {"wall_error_median_m": 0.0, "wall_error_p95_m": 0.0}


def test_a_bent_map_keeps_its_error(ground):
    """A twin: no rigid motion takes away what is wrong."""
    true = walls_of(ground)
    bent = true + np.c_[np.zeros(len(true)), 0.01 * (true[:, 0] - 10.0) ** 2]
    placed = published_maps.laid_on(ground, bent - published_maps.NEAR)
    assert wall_errors(ground, published_maps.as_evidence(ground, placed.walls_m))[
        "wall_error_p95_m"] >= 0.4


def test_without_the_maps_it_says_so(monkeypatch, tmp_path):
    monkeypatch.setattr(published_maps, "MAPS", tmp_path / "mrs_testbed_maps")
    monkeypatch.setattr(sys, "argv", ["published_maps.py"])
    with pytest.raises(SystemExit, match="^published_maps: the authors' maps are not in "):
        published_maps.main()


def test_an_unknown_terrain_is_refused(repository):
    tool = repository / "tools" / "measurements" / "published_maps.py"
    done = subprocess.run([sys.executable, tool, "moon"], text=True, capture_output=True)
    assert done.returncode == 2
    assert "unknown terrain moon; known: maze, loop, cross, zigzag" in done.stderr
