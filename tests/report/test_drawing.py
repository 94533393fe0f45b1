"""Pictures are drawn with desim's settings, whatever lies in the current folder."""

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from desim.imports.terrains.found import FoundTerrain
from desim.report.drawing import drawing
from desim.report.terrain_figure import draw_terrain
from desim.world.terrain import of_free_cells


@pytest.fixture
def from_the_folder(monkeypatch):
    """Settings of a matplotlibrc in the current folder, or of the user's own."""
    monkeypatch.setitem(matplotlib.rcParams, "text.usetex", True)
    monkeypatch.setitem(matplotlib.rcParams, "font.size", 40.0)


def test_no_latex_is_started(from_the_folder, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with drawing({"axes.titlesize": 11}):
        assert matplotlib.rcParams["axes.titlesize"] == 11
        assert matplotlib.rcParams["font.size"] == matplotlib.rcParamsDefault["font.size"]
        figure = Figure()
        figure.text(0.5, 0.5, r"$\input{/etc/passwd}$")
        figure.savefig(tmp_path / "a.png")
    assert matplotlib.rcParams["text.usetex"]


def test_without_it_latex_would_be(from_the_folder, tmp_path, monkeypatch):
    """The twin."""
    monkeypatch.setenv("PATH", str(tmp_path))
    figure = Figure()
    figure.text(0.5, 0.5, "text")
    with pytest.raises(RuntimeError, match="latex could not be found"):
        figure.savefig(tmp_path / "a.png")


@pytest.mark.parametrize(("rows", "height"), [(8, 8.0), (3, 4.0), (1, 2.4), (18, 16.0), (98, 24.0)])
def test_a_terrain_s_picture_has_its_shape_from_a_strip_to_a_tower(tmp_path, rows, height):
    """10 m wide, drawn 8 inches wide, with an inch for the title and the axis."""
    terrain = of_free_cells(tmp_path / "a", np.ones((rows, 8), bool), 0, 1.0, (0.0, 0.0), 2.0)
    draw_terrain(FoundTerrain(terrain, None), "Ten", tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size == pytest.approx((160 * 8, 160 * (height + 1)), abs=1)
