"""Runs that are not as most are: each gives a page or one clear error."""

from collections import Counter

import numpy as np
import pytest
from devtools import Browser
from unpacking import unpacked

import desim
from desim.api import recording_of
from desim.errors import InputError, ModelError
from desim.report.replay.bundle import bundle
from desim.report.replay.page import write
from desim.results.run import Run


def made(repository, out, *changes):
    """A run of hello.yaml with changes."""
    return desim.run(desim.load(repository / "scenarios" / "hello.yaml", list(changes)), out=out)


def shown(run, folder):
    """The page's first line after it was drawn at the end of the run, and the positions there."""
    page = folder / "replay.html"
    write([recording_of(run)], page)
    with Browser(folder / "profile") as browser:
        browser.open(page)
        browser.value("desimReplay.at(desimReplay.span()[1])")
        assert browser.complaints == []
        return (browser.value("document.querySelector('#about').textContent"),
                browser.value("desimReplay.positions()"))


def test_one_robot(tmp_path, repository, browser_here):
    run = made(repository, tmp_path, "fleet.size=1")
    text, positions = shown(run, tmp_path)
    assert text == "seed 1  ·  testbed  ·  explored"
    assert len(positions) == 1


def test_a_run_of_an_instant(tmp_path, repository, browser_here):
    run = made(repository, tmp_path, "stop.elapsed=1 ms")
    assert len(shown(run, tmp_path)[1]) == 3


def test_a_robot_without_software_and_a_host_that_stops(tmp_path, repository, browser_here):
    run = made(repository, tmp_path, "robot.passive=[robot_2]", "stop.elapsed=6 s",
               "faults=[{at: 2 s, host: robot_1, down_for: 2 s}]")
    about, columns = bundle(recording_of(run))
    assert [event[1:3] for event in about["events"]][:2] == [
        ["host_stopped", "robot_1 stops"], ["host_started", "robot_1 starts again"]]
    assert [life[0] for life in about["lives"]] == [0, 1, 1]
    explored = unpacked(columns.index, columns.text())["second.explored"]
    assert (explored[2] <= 0).all() and explored[0, -1] > 0
    assert len(shown(run, tmp_path)[1]) == 3
    with Browser(tmp_path / "other") as browser:
        browser.open(tmp_path / "replay.html")
        up = browser.value("""[0, 1.9, 2.1, 3.9, 4.1, 6].map(
            (at) => [...desimReplay.app.runs[0].upAt(at).robots])""")
    # The robot without software has no life that was recorded.
    assert [robots[1] for robots in up] == [1, 1, 0, 0, 1, 1]
    assert {(robots[0], robots[2]) for robots in up} == {(1, 1)}


def broken(frame, receivers):
    """A rule that fails when it is asked the hundredth time, with words that could end a page."""
    broken.asked = getattr(broken, "asked", 0) + 1
    if broken.asked == 100:
        raise RuntimeError("broken</script>{{script}}")
    return desim.ports.Pass()


def test_a_failed_run_is_shown_until_it_failed(tmp_path, repository, browser_here):
    with pytest.raises((RuntimeError, ModelError)):
        made(repository, tmp_path, "network.media.lan.model=switch",
             f"network.media.lan.rules=[{{rule: '{__name__}:broken'}}]")
    [folder] = (tmp_path / "hello").iterdir()
    text, positions = shown(Run(folder), tmp_path)
    assert "FAILED" in text and "broken</script>{{script}}" in text
    assert len(positions) == 3


def test_damage_is_named(tmp_path, repository):
    run = made(repository, tmp_path, "stop.elapsed=2 s")
    poses = run.path / "poses.parquet"
    poses.write_bytes(poses.read_bytes()[:-9])
    with pytest.raises(InputError, match=r"damaged: poses.parquet .* mends it"):
        write([recording_of(Run(run.path))], tmp_path / "replay.html")
    assert not (tmp_path / "replay.html").exists()


def test_a_run_without_a_recording_is_made_again(tmp_path, repository):
    kept = made(repository, tmp_path / "kept", "stop.elapsed=2 s")
    bare = made(repository, tmp_path / "bare", "stop.elapsed=2 s", "trace.keep=none")
    columns = [bundle(recording_of(run))[1] for run in (kept, bare)]
    one, other = (unpacked(each.index, each.text()) for each in columns)
    assert one.keys() == other.keys()
    assert all((one[name] == other[name]).all() for name in one)


def test_a_file_that_cannot_be_written(tmp_path, hello):
    with pytest.raises(InputError, match=r"^--to: .*/no/page.html cannot be written: No such file "
                                         "or directory$"):
        write([recording_of(hello)], tmp_path / "no" / "page.html")


def test_large_runs_are_reduced_and_say_so(hello, monkeypatch):
    from desim.report.replay import bundle as bundles
    from desim.report.replay import events, growth, traffic

    monkeypatch.setattr(traffic, "MAX_MESSAGES", 40)
    monkeypatch.setattr(traffic, "MAX_LOADS", 100)
    monkeypatch.setattr(growth, "MAX_CELLS", 10_000)
    monkeypatch.setattr(bundles, "MAX_PLAN_POINTS", 50)
    monkeypatch.setattr(events, "MOST", 0)
    about, columns = bundle(recording_of(hello))
    found = unpacked(columns.index, columns.text())
    assert about["notes"][0] == (
        "each robot's own map is kept in cells of 0.8 m, the merged one in cells of 0.2 m")
    assert about["notes"][1].startswith("40 of 2")
    assert about["notes"][2] == f"loads of links are means over {about['load_s']} s"
    assert about["notes"][3].startswith("plans are drawn through one point in ")
    assert about["notes"][4] == "0 of 2 events are listed, evenly"
    assert len(found["message.number"][0]) == 40
    assert len(found["load.bytes"][0]) <= 100
    assert found["load.bytes"].sum() == found["topic.bytes"].sum()
    coarse, width = found["growth.0.known.is"][0].size, -(-about["growth"]["width"] // 4)
    assert coarse == width * width
    assert np.isin(found["merged.known.is"], (False, True)).all()


def test_of_too_many_links_the_busiest_have_loads(hello, monkeypatch):
    from desim.report.replay import traffic

    def by_link(columns):
        found = unpacked(columns.index, columns.text())
        sums = Counter()
        for *link, size_bytes in zip(*(found[f"load.{name}"][0].tolist() for name in (
                "source", "destination", "kind", "bytes")), strict=True):
            sums[tuple(link)] += size_bytes
        return sums

    every = by_link(bundle(recording_of(hello))[1])
    monkeypatch.setattr(traffic, "MAX_LOADS", 8)
    about, columns = bundle(recording_of(hello))
    assert by_link(columns) == dict(every.most_common(2))
    assert f"only the 2 busiest of {len(every)} links have loads" in about["notes"]
