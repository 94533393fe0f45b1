"""Of busy computers: load, memory and missed ticks of robots, and processes that are killed."""

import numpy as np
import pytest
from devtools import Browser
from test_bundle import columns_of

import desim
from desim.api import recording_of
from desim.report.replay.page import write

# A tick of move_base takes longer than its period, and mapping needs more memory than there is.
COSTS = ("{model: table, callbacks: {move_base: {any: {fixed: 130 ms}}}, memory: {system: 10 MB, "
         "processes: {mapping: {fixed: 1 MB, per: {cells: 100 B}}}}}")


def made(repository, out, *changes):
    return desim.run(repository / "scenarios/hello.yaml", out=out, overrides=[
        f"computers={COSTS}", "robot.computer.processors=1", "stop.elapsed=8 s", *changes])


@pytest.fixture(scope="module")
def busy(tmp_path_factory, repository):
    return made(repository, tmp_path_factory.mktemp("busy"))


@pytest.fixture(scope="module")
def killed(tmp_path_factory, repository):
    """With less memory than mapping needs."""
    return made(repository, tmp_path_factory.mktemp("killed"), "robot.computer.memory=12 MB",
                "robot.computer.respawn_delay=2 s")


def test_the_bundle_has_what_the_table_of_robots_has(busy):
    about, found = columns_of(busy)
    assert about["computers"] == {"processors": [1, 1, 1], "memory_mb": [None, None, None]}
    for name, column, scale in (("busy_ms", "cpu_s", 1e3), ("missed", "missed_ticks", 1),
                                ("ram_kb", "ram_mb", 1e3)):
        of_robots = np.rint(busy.robots[column] * scale).reshape(-1, 3).T
        assert (found[f"computer.{name}"] == of_robots).all() and of_robots[:, -1].all()
    assert found["computer.busy_ms"].shape[1] == found["second.us"].shape[1]


def test_missed_ticks_are_an_event_of_each_robot(busy):
    about, _ = columns_of(busy)
    listed = {subject: text for _, kind, text, [subject] in about["events"]
              if kind == "missed_ticks"}
    assert listed == {name: f"{name}: busy nodes miss {robot['missed_ticks']} ticks of their "
                            "timers until 8 s" for name, robot in busy.metrics["robots"].items()}


def test_a_killed_process_is_named_and_the_robot_starts_again(killed):
    about, _ = columns_of(killed)
    assert about["computers"]["memory_mb"] == [12, 12, 12]
    own = [(kind, text) for _, kind, text, subjects in about["events"] if subjects == ["robot_1"]]
    assert own[:3] == [
        ("out_of_memory", "robot_1 runs out of memory: mapping is killed, the rest dies with it"),
        ("host_stopped", "robot_1 stops"), ("host_started", "robot_1 starts again")]


def test_ideal_computers_are_not_in_the_bundle(hello):
    about, found = columns_of(hello)
    assert about["computers"] is None
    assert not [name for name in found if name.startswith("computer.")]
    assert not [kind for _, kind, *_ in about["events"] if kind == "missed_ticks"]


@pytest.fixture(scope="module")
def page(browser_here, tmp_path_factory, busy):
    """The replay in a browser."""
    file = tmp_path_factory.mktemp("page") / "replay.html"
    write([recording_of(busy)], file)
    with Browser(tmp_path_factory.mktemp("profile")) as browser:
        browser.open(file)
        yield browser
        assert browser.complaints == []


def test_the_page_shows_the_load_of_a_robot(page, busy):
    page.value("desimReplay.at(6), desimReplay.select({kind: 'robot', robot: 1})")
    titles = page.value("[...document.querySelectorAll('#charts b')].map((one) => one.textContent)")
    assert titles[-3:] == ["processors", "memory", "missed ticks of timers"]
    shares = page.value("[0, 1, 2].map((robot) => desimReplay.app.runs[0].busyShare(robot, 6))")
    seconds = busy.robots["cpu_s"].reshape(-1, 3)
    assert shares == pytest.approx((seconds[6] - seconds[5]).tolist(), abs=0.002)
    assert min(shares) > 0.9


def test_busy_processors_are_drawn(page):
    picture = ("desimReplay.draw(), [...document.querySelector('.pane').querySelectorAll('canvas')]"
               ".map((sheet) => sheet.toDataURL()).join()")
    layers = "desimReplay.app.layers"
    page.value("desimReplay.at(6), desimReplay.select({})")
    with_bars = page.value(picture)
    assert page.value(f"{layers}.delete('busy'), {picture}") != with_bars
    assert page.value(f"{layers}.add('busy'), {picture}") == with_bars
