"""Runs and campaigns as data frames."""

import sys

import pytest
from designs import BASE

import desim
from desim.errors import InputError


@pytest.fixture
def run(tmp_path):
    (tmp_path / "small.yaml").write_text(BASE)
    return desim.run(tmp_path / "small.yaml", out=tmp_path / "results")


def test_without_pandas_the_extra_is_named(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(InputError) as refused:
        run.to_pandas()
    assert str(refused.value) == (
        "to_pandas(): pandas is not installed; pip install 'desim[notebook]'")


def test_a_run_as_a_data_frame(run):
    pytest.importorskip("pandas")
    frame = run.to_pandas()
    assert [*frame.columns] == [*run.samples]
    assert (frame["time_s"] == run.samples["time_s"]).all()
    assert {*run.to_pandas("robots")["robot"]} == {"robot_0", "robot_1"}


def test_a_campaign_as_a_data_frame(tmp_path, monkeypatch):
    pytest.importorskip("pandas")
    from typer.testing import CliRunner

    from desim.cli import app

    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.yaml").write_text(BASE)
    CliRunner().invoke(app, ["sweep", "small.yaml", "--vary", "fleet.size=1,2", "--seeds", "2",
                             "--jobs", "1"])
    frame = desim.Campaign("results/small_size").to_pandas()
    assert frame.groupby("size")["seed"].agg(list).to_dict() == {1: [1, 2], 2: [1, 2]}
