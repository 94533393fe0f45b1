"""Pictures are drawn with desim's settings, whatever lies in the current folder."""

import matplotlib
import pytest
from matplotlib.figure import Figure

from desim.report.drawing import drawing


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
