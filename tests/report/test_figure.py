"""The picture of a run: four panels, for few robots and for many, for odd runs too."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from PIL import Image

import desim
from desim.errors import InputError
from desim.report import run_figure


@pytest.fixture(scope="module")
def run(repository, tmp_path_factory):
    return desim.run(repository / "scenarios" / "hello.yaml", overrides=("stop.elapsed=8 s",),
                     out=tmp_path_factory.mktemp("results"))


def pixels(path) -> np.ndarray:
    return np.asarray(Image.open(path).convert("RGB"))


def test_four_panels_are_drawn(run, tmp_path):
    run_figure.draw(run, tmp_path / "figure.png")
    colours = pixels(tmp_path / "figure.png") @ np.array([1 << 16, 1 << 8, 1])
    height, width = colours.shape
    assert (height, width) > (1000, 1200)
    for rows in (slice(0, height // 2), slice(height // 2, height)):
        for columns in (slice(0, width // 2), slice(width // 2, width)):
            assert len(np.unique(colours[rows, columns])) > 20


def test_the_legend_of_the_map_counts_its_wrong_cells(run, tmp_path, monkeypatch):
    found = []
    monkeypatch.setattr(run_figure, "save", lambda drawn, path: found.append(drawn))
    run_figure.draw(run, tmp_path / "figure.png")
    axes = found[0].axes[1]
    *_, wrong = axes.images
    assert [text.get_text() for text in axes.get_legend().get_texts()] == [
        "free", "occupied", "unknown", f"wrong ({wrong.get_array().count()} cells)"]


def test_where_computers_get_busy_their_loads_are_drawn(repository, tmp_path, monkeypatch):
    """Figure 6 of the paper: of each robot, and the mean; rates over 5 s as in samples.parquet."""
    run = desim.run(repository / "scenarios" / "hello.yaml", out=tmp_path,
                    overrides=("stop.elapsed=11 s", "computers=measured", "measure.every=5 s"))
    found = []
    monkeypatch.setattr(run_figure, "save", lambda drawn, path: found.append(drawn))
    run_figure.draw(run, tmp_path / "figure.png")
    *_, cpu, ram, received, sent = found[0].axes
    assert [axes.get_title() for axes in (cpu, ram, received, sent)] == [
        "(e) CPU [%]", "(f) RAM [MB]", "(g) received [kB/s]", "(h) sent [kB/s]"]
    for axes, name in (cpu, "cpu_percent"), (received, "rx_kBps"), (sent, "tx_kBps"):
        *robots, mean = axes.get_lines()
        assert mean.get_xdata().tolist() == [5, 10]
        assert mean.get_ydata() == pytest.approx(run.samples[name][1:3])
        each = np.array([line.get_ydata() for line in robots])
        assert each.shape == (3, 2)
        low, high = each.mean(axis=0) - each.std(axis=0), each.mean(axis=0) + each.std(axis=0)
        (band,) = axes.collections
        corners = band.get_paths()[0].vertices
        assert corners.min(axis=0) == pytest.approx([5, low.min()])
        assert corners.max(axis=0) == pytest.approx([10, high.max()])
    assert ram.get_lines()[-1].get_ydata()[-1] == pytest.approx(run.samples["ram_mb"][-1])


WITHOUT_MEMORY = """
from desim import ports


class OneMillisecond:
    class Params(ports.Params):
        pass

    def __init__(self, params):
        pass

    def callback_ns(self, work):
        return 10**6

    def send_ns(self, topic, size_bytes, links):
        return 0

    def receive_ns(self, topic, size_bytes):
        return 0
"""


def test_a_cost_model_that_knows_no_memory_has_no_panel_of_it(repository, tmp_path, monkeypatch):
    (tmp_path / "without_memory.py").write_text(WITHOUT_MEMORY)
    (tmp_path / "own.yaml").write_text(
        f"extends: {repository / 'scenarios' / 'hello.yaml'}\nname: own\nstop: {{elapsed: 6 s}}\n"
        "computers: without_memory:OneMillisecond\n")
    run = desim.run(tmp_path / "own.yaml", out=tmp_path)
    found = []
    monkeypatch.setattr(run_figure, "save", lambda drawn, path: found.append(drawn))
    run_figure.draw(run, tmp_path / "figure.png")
    assert [axes.get_title() for axes in found[0].axes[-3:]] == [
        "(e) CPU [%]", "(f) received [kB/s]", "(g) sent [kB/s]"]


def test_ways_are_bent_as_robots_turn():
    """A quarter of a circle of 1 m: on it to 4.3 cm, where a straight line is 29 cm off."""
    yaw_rad = np.array([np.pi / 2, np.pi])
    x_m, y_m = run_figure.bent(np.array([1.0, 0.0]), np.array([0.0, 1.0]), yaw_rad)
    assert (x_m[0], y_m[0], x_m[-1], y_m[-1]) == pytest.approx((1.0, 0.0, 0.0, 1.0))
    assert np.abs(np.hypot(x_m, y_m) - 1.0).max() < 0.043
    x_m, y_m = run_figure.bent(np.array([0.0, 2.0, 2.0]), np.zeros(3), np.array([0.0, 0.0, 2.0]))
    assert (np.diff(x_m) >= 0).all() and not y_m.any()  # ahead, then a turn on the spot
    assert len(run_figure.bent(np.ones(1), np.ones(1), np.ones(1))[0]) == 1


def test_a_partition_is_shaded_and_named(run, tmp_path, monkeypatch):
    found = []
    monkeypatch.setattr(run_figure, "save", lambda drawn, path: found.append(drawn))
    partitions = {"count": 2, "total_s": 3.0, "longest_s": 2.0, "most_parts": 2,
             "episodes_s": [[1.0, 3.0], [5.0, 6.0]]}
    monkeypatch.setitem(run.metrics, "partitions", partitions)
    run_figure.draw(run, tmp_path / "figure.png")
    terrain, *_, explored, traffic = found[0].axes
    assert terrain.get_title() == "(a) Terrain and true ways of the robots"
    for axes in explored, traffic:
        shaded = [patch.get_extents().transformed(axes.transData.inverted())
                  for patch in axes.patches]
        assert [(round(box.x0, 6), round(box.x1, 6)) for box in shaded] == [(1.0, 3.0), (5.0, 6.0)]
        assert "fleet split, 2 times, 3 s in all" in [
            text.get_text() for text in axes.get_legend().get_texts()]


@pytest.mark.parametrize(("file", "complaint"), [
    ("figure.txt", "{} does not end like a picture; allowed: .png, .pdf, .svg"),
    ("figure.pgf", "{} does not end like a picture; allowed: .png, .pdf, .svg"),
    ("no/figure.png", "{} cannot be written: No such file or directory"),
])
def test_a_file_that_cannot_be_a_picture(run, tmp_path, file, complaint):
    path = tmp_path / file
    with pytest.raises(InputError) as caught:
        run_figure.draw(run, path)
    assert str(caught.value) == f"--to: {complaint.format(path)}"


def test_a_damaged_folder_is_named(run, tmp_path):
    copy = shutil.copytree(run.path, tmp_path / run.path.name)
    (copy / "robots.parquet").write_bytes(b"PAR1")
    (copy / "summary.json").write_text("{")
    damaged = desim.Run(copy)
    with pytest.raises(InputError, match=r"damaged: robots\.parquet is not what "):
        damaged.table("robots")
    with pytest.raises(InputError, match=r"damaged: summary\.json is not what "):
        damaged.metrics  # noqa: B018 - reading it is the test


def test_many_robots_share_a_colour_bar(run, tmp_path, monkeypatch):
    monkeypatch.setattr(run_figure, "NAMED", 2)
    run_figure.draw(run, tmp_path / "figure.svg")
    drawn = (tmp_path / "figure.svg").read_text()
    assert "robot, robot_0 to robot_2" in drawn


def test_doors_and_moving_obstacles_are_drawn(repository, tmp_path):
    drawn = {}
    for name, environment in (("bare", ()), ("furnished", (
            "environment.doors=[{from: [4 m, -4 m], to: [4 m, 4 m], open: [[0 s, 1 s]]},"
            " {from: [-4 m, 4 m], to: [-4 m, 12 m]}]",
            "environment.moving_obstacles=[{path: [[-10 m, -6 m], [10 m, -6 m]]}]"))):
        run = desim.run(repository / "scenarios" / "hello.yaml", out=tmp_path / name,
                        overrides=("stop.elapsed=1 s", *environment))
        run_figure.draw(run, tmp_path / f"{name}.svg")
        drawn[name] = (tmp_path / f"{name}.svg").read_text()
    for label in ("door, open at the start", "door, closed at the start",
                  "path of a moving obstacle"):
        assert label in drawn["furnished"]
        assert label not in drawn["bare"]


def test_a_robot_alone_that_says_nothing(repository, tmp_path):
    run = desim.run(repository / "scenarios" / "hello.yaml", out=tmp_path, overrides=(
        "stop.elapsed=2 s", "deployment=field", "fleet.size=1"))
    assert run.metrics["messages_sent"] == 0
    run_figure.draw(run, tmp_path / "figure.svg")
    assert "no messages between hosts" in (tmp_path / "figure.svg").read_text()


def test_the_same_run_gives_the_same_picture(run, tmp_path):
    for name in ("first.png", "second.png"):
        run_figure.draw(run, tmp_path / name)
    assert (pixels(tmp_path / "first.png") == pixels(tmp_path / "second.png")).all()
