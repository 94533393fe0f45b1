"""A run that is watched while it goes on: in the end its page has what its replay has."""

from __future__ import annotations

import json
from contextlib import contextmanager
from itertools import count

import numpy as np
import pytest
from devtools import Browser
from unpacking import unpacked

import desim
from desim.api import recording_of
from desim.engine.kernel import Phase
from desim.errors import InputError
from desim.report.live.browser import page_sink
from desim.report.live.feed import LiveFeed, ViewersTime
from desim.report.live.server import ChunkLog, LiveServer
from desim.report.live.stretch import Stretches
from desim.report.live.watch import live
from desim.report.replay.bundle import bundle
from desim.report.replay.page import page, write

S = 1_000_000_000


def fed(log, clock, pace=float("inf")):
    """A ``watch`` that adds a run's chunks to ``log``."""
    @contextmanager
    def watch(simulation, folder):
        feed = LiveFeed(Stretches(simulation, folder, folder.recorder), [page_sink(log)],
                        pace, clock)
        simulation.kernel.ticker(1, Phase.OBSERVE, (1 << 64) - 1, feed.sample)
        yield
        feed.end()

    return watch


@pytest.fixture(scope="module")
def followed(tmp_path_factory, repository):
    """A run of hello, and its chunks: one each second, with maps now and then."""
    log = ChunkLog()
    run = desim.run(repository / "scenarios" / "hello.yaml", out=tmp_path_factory.mktemp("live"),
                    watch=fed(log, ViewersTime(now_s=count(0.0, 0.2).__next__)))
    return run, log


def chunks(log):
    return [(about, unpacked(about["columns"], text))
            for about, text in map(json.loads, log.chunks)]


def test_looking_changes_nothing(followed, hello):
    assert followed[0].manifest["digest"] == hello.manifest["digest"]


def test_stretches_follow_each_other_without_gap(followed):
    run, log = followed
    abouts = [about for about, _ in chunks(log)]
    assert abouts[0]["start_ns"] == 0
    assert abouts[-1]["end_ns"] == round(run.manifest["simulated_s"] * S)
    assert all(one["end_ns"] == other["start_ns"] and other["start_ns"] % S == 0
               for one, other in zip(abouts, abouts[1:], strict=False))
    assert len(abouts) > 10
    assert {about["status"] for about in abouts[:-1]} == {"running"}
    assert abouts[-1]["status"] == "finished"


def test_the_chunks_together_are_the_recording(followed):
    run, log = followed
    recording, parts = recording_of(run), chunks(log)

    def together(name):
        return np.concatenate([columns[name] for _, columns in parts], axis=1)

    assert (together("pose.ns")[0] == recording.poses.times_ns).all()
    assert (together("pose.x_mm") == recording.poses.xy_mm[:, :, 0].T).all()
    assert together("plan.ns").shape[1] == len(recording.plans)
    assert together("link.ns").shape[1] == len(recording.links)
    assert together("load.bytes").sum() == sum(
        row["size_bytes"] for row in recording.messages.to_pylist() if row["fate"] == "delivered")
    maps = [columns for about, columns in parts if about["growth"]]
    assert 2 < len(maps) < len(parts)
    known = [columns["merged.known.is"].sum() for columns in maps]
    assert known == sorted(known)


def test_the_chunks_together_have_who_hangs_on_whom(repository, tmp_path):
    log = ChunkLog()
    run = desim.run(repository / "scenarios" / "warehouse_wifi.yaml", out=tmp_path, overrides=(
        "network.media.air.infrastructure.associated=false", "stop.elapsed=5 s",
        "faults=[{at: 4 s, host: robot_0, down_for: 2 s}]"),
        watch=fed(log, ViewersTime(now_s=count(0.0, 0.3).__next__)))
    about, columns = bundle(recording_of(run))
    whole, parts = unpacked(columns.index, columns.text()), chunks(log)
    assert len(parts) > 2 and whole["association.ns"].size == 7
    for name in ("ns", "host", "access_point", "hangs"):
        assert (np.concatenate([part[f"association.{name}"] for _, part in parts], axis=1)
                == whole[f"association.{name}"]).all()
    for name in ("access_points", "stations"):  # the page has them of the first chunk
        assert len(parts[0][0][name]) == 6 and parts[0][0][name] == about[name]


def test_a_robot_is_up_between_its_maps(browser_here, followed, tmp_path):
    """A map's last instant is not the end of its robot: with maps in the first chunk alone, robots
    are drawn with their fans until now, in the colours that the replay has then."""
    _, log = followed
    part = ChunkLog()
    for text in log.chunks[:4]:
        about, columns = json.loads(text)
        if part.chunks:
            about["growth"] = None
        part.add(json.dumps([about, columns]))
    with LiveServer(page([]), part) as server, Browser(tmp_path / "one") as browser:
        browser.open(server.url)
        seen = browser.value("""new Promise((resolve) => { const wait = () => {
            const { app } = desimReplay, run = app.runs[0];
            if (run.endS < 4) { setTimeout(wait, 10); return; }
            resolve([0.4, 1.5, 4].map((at) => [...run.upAt(at).robots])); }; wait(); })""")
        assert browser.complaints == []
    assert seen == [[1, 1, 1]] * 3


def test_maps_take_a_tenth_of_the_time(followed):
    """Each reading of the clock takes 0.2 s here: maps 0.2 s, so the next ones 2 s later."""
    with_maps = [k for k, (about, _) in enumerate(chunks(followed[1])) if about["growth"]]
    assert with_maps[0] == 0 and min(np.diff(with_maps[:-1])) > 1


def test_a_run_waits_for_its_pace(tmp_path, repository):
    waits = []
    desim.run(repository / "scenarios" / "hello.yaml", out=tmp_path,
              overrides=("stop.elapsed=4 s",),
              watch=fed(ChunkLog(), ViewersTime(lambda: 0.0, waits.append), pace=2.0))
    assert waits == [0.5, 1.0, 1.5, 2.0]


def test_the_page_of_a_live_run_ends_as_its_replay(browser_here, followed, tmp_path):
    run, log = followed
    write([recording_of(run)], tmp_path / "replay.html")
    facts = """(() => { const run = desimReplay.app.runs[0]; desimReplay.at(20); return [
        desimReplay.positions(), run.message.length, run.pose.length, run.second.length,
        [...run.message.at.born_us], run.events, [...run.topic.at.bytes[0]],
        run.about.facts, run.about.families.length,
        document.querySelectorAll("#events li").length]; })()"""
    with Browser(tmp_path / "one") as browser:
        browser.open(tmp_path / "replay.html")
        wanted = browser.value(facts)
        assert browser.complaints == []
    with LiveServer(page([]), log) as server, Browser(tmp_path / "other") as browser:
        browser.open(server.url)
        browser.value("""new Promise((resolve) => { const wait = () =>
            !desimReplay.playing() ? resolve(true) : setTimeout(wait, 10); wait(); })""")
        assert browser.value("desimReplay.time()") == run.manifest["simulated_s"]
        found = browser.value(facts)
        assert browser.complaints == []
    assert found == wanted


def test_a_run_without_a_recording_cannot_be_live(tmp_path, repository):
    def watch(simulation, folder):
        return live(simulation, folder, [])

    with pytest.raises(InputError) as error:
        desim.run(repository / "scenarios" / "hello.yaml", out=tmp_path,
                  overrides=("trace.keep=none",), watch=watch)
    assert str(error.value) == ("a run with trace.keep none or messages has nothing to show "
                                "while it goes on; allowed: replay, all")
