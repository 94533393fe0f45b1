"""Two runs side by side: keys, metrics, and the instant at which their robots part."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import desim
from desim.cli import app
from desim.errors import InputError, ModelError
from desim.results.comparison import KeyDifference, MetricPair, Parting, _parting, different_keys


def made(repository, out, *overrides):
    return desim.run(repository / "scenarios" / "hello.yaml", out=out,
                     overrides=("stop.elapsed=9 s", *overrides))


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    return tmp_path_factory.mktemp("results")


@pytest.fixture(scope="module")
def first(repository, out):
    return made(repository, out)


@pytest.fixture(scope="module")
def second(repository, out):
    """Robot 1 is held back after a second."""
    return made(repository, out, "faults=[{at: 1 s, host: robot_1, down_for: 2 s}]")


def test_keys_are_compared_by_dotted_path():
    assert different_keys({"a": {"b": 1, "c": [1, 2]}, "d": None},
                          {"a": {"b": 1.0, "c": [1, 3]}, "e": [{"f": 2}]}) == [
        KeyDifference("a.c", [1, 2], [1, 3]), KeyDifference("e.0.f", None, 2)]


@pytest.mark.parametrize("one, other, difference, percent", [
    (4, 5, 1, 25.0), (-4.0, -5.0, -1.0, -25.0), (0, 3, 3, None), (None, 3, None, None),
    ("robot_0", "robot_1", None, None)])
def test_a_difference_is_the_second_minus_the_first(one, other, difference, percent):
    pair = MetricPair("m", one, other)
    assert (pair.difference, pair.percent) == (difference, percent)


def test_two_runs(first, second):
    found = desim.compare(first.path, second)
    assert [key.key for key in found.keys] == ["faults", "faults.0.kind", "faults.0.at",
                                               "faults.0.host", "faults.0.down_for"]
    assert not found.is_same
    by_name = {pair.name: pair for pair in found.metrics}
    cost = by_name["exploration_cost_m"]
    assert cost.difference == second.metrics["exploration_cost_m"] - \
        first.metrics["exploration_cost_m"]
    assert not any(name.startswith("messages_by_topic") for name in by_name)


def test_the_robot_that_was_held_back_parts_first(first, second):
    parted = desim.compare(first, second).parted
    assert parted.robot == "robot_1" and 1.0 < parted.time_s < 2.0
    assert all(first.table("poses")[name][second.table("poses")["time_ns"] <= 1e9].tolist() ==
               second.table("poses")[name][second.table("poses")["time_ns"] <= 1e9].tolist()
               for name in ("x_mm", "y_mm"))


def test_places_once_a_second_stand_in_for_poses_that_were_not_kept(repository, out, second):
    bare = made(repository, out, "trace.keep=none")
    parted = desim.compare(bare, second).parted
    assert parted.robot == "robot_1" and parted.time_s == 2.0


@pytest.mark.parametrize("one, other, parted", [
    ((0.0, 0.0, np.pi), (0.0, 0.0, -np.pi), None),
    ((0.0, 0.0, 3.142), (0.0, 0.0, -3.141), None),
    ((0.0, 0.0, 0.001), (0.0, 0.0, 0.002), Parting(1.0, "robot_0", 0.0)),
    ((0.001, 0.0, 0.0), (0.0, 0.0, 0.0), Parting(1.0, "robot_0", 0.001))])
def test_one_heading_has_two_names(one, other, parted):
    times_ns = np.array([0, 10**9])
    tracks = [(times_ns, np.array([(0.0, 0.0, 0.0), pose])) for pose in (one, other)]
    assert _parting("robot_0", *tracks) == parted


def test_a_run_and_itself(first):
    found = desim.compare(first, first)
    assert found.is_same and found.parted is None and found.keys == []
    assert all(pair.is_equal for pair in found.metrics)


def test_fleets_of_other_sizes_are_compared_by_the_robots_that_both_have(repository, out, first):
    found = desim.compare(first, made(repository, out, "fleet.size=1"))
    assert found.parted.robot == "robot_0"


def test_the_command(first, second):
    done = CliRunner().invoke(app, ["compare", str(first.path), str(second.path)])
    assert done.exit_code == 0
    lines = [" ".join(line.split()) for line in done.output.splitlines()]
    assert lines[:2] == [f"first {first.path}", f"second {second.path}"]
    assert "faults.0.host - robot_1" in lines
    assert f"the first trace row that differs: desim diff {first.path} {second.path}" in lines
    done = CliRunner().invoke(app, ["compare", str(first.path), str(second.path), "--json"])
    assert json.loads(done.output)["parted"]["robot"] == "robot_1"


def test_a_failed_run_has_no_metrics_to_compare(first, repository, tmp_path, monkeypatch):
    (tmp_path / "boom.py").write_text("def now(quantities):\n    return 1 / 0\n")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ModelError):
        made(repository, "out", "stop.when=boom:now")
    path, = (tmp_path / "out" / "hello").iterdir()
    found = desim.compare(path, first)
    assert found.failed == [found.first] and found.metrics == [] and not found.is_same
    done = CliRunner().invoke(app, ["compare", str(path), str(first.path)])
    assert done.exit_code == 0
    assert done.output.splitlines()[-1].startswith(
        f"{path} failed: stop.when: boom:now raised ZeroDivisionError: division")
    assert "boom:now raised ZeroDivisionError" in found._repr_html_()


def test_what_is_no_run(first, tmp_path):
    with pytest.raises(InputError, match="not the folder of a run"):
        desim.compare(first, tmp_path)
