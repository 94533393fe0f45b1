"""Marks of messages beside robots: they hide none, and a fleet of hundreds has none at first."""

from contextlib import nullcontext
from pathlib import Path

import pytest
from devtools import Browser

import desim
from desim.api import recording_of
from desim.engine.kernel import Phase
from desim.report.replay import page as replay_page
from desim.report.replay.page import write
from desim.results.run import Run

pytestmark = pytest.mark.usefixtures("browser_here")

# By robot: the pixels of the alarm's colour on its body, and around it.
RED = """(() => {
    const { app } = desimReplay, pane = document.querySelector(".pane"), found = [];
    const sheet = [...pane.querySelectorAll("canvas")].at(-1), { camera } = app.stage;
    const [red, green, blue] = app.theme.alarm.match(/\\w\\w/g).map((part) => parseInt(part, 16));
    for (const [x, y] of desimReplay.positions()) for (const far of [3, 30]) {
        const side = 2 * far, { data } = sheet.getContext("2d").getImageData(
            Math.round(camera.sx(x)) - far, Math.round(camera.sy(y)) - far, side, side);
        let count = 0;
        for (let k = 0; k < data.length; k += 4) {
            if (data[k] === red && data[k + 1] === green && data[k + 2] === blue) count += 1;
        }
        found.push(count);
    }
    return found; })()"""


def opened(run, folder):
    write([recording_of(run)], folder / "replay.html")
    browser = Browser(folder / "profile")
    browser.open(folder / "replay.html")
    return browser


def test_counts_of_waiting_messages_are_beside_bodies(repository, tmp_path):
    run = desim.run(desim.load(repository / "scenarios" / "hello.yaml", [
        "network.media={lan: {model: switch, rate: 100 kb/s}}", "stop.elapsed=6 s"]), out=tmp_path)
    with opened(run, tmp_path) as browser:
        browser.value("desimReplay.at(5.5)")
        waiting = browser.value("[...desimReplay.app.scenes[0].flights.waiting.values()]")
        red = browser.value(RED)
        assert len(waiting) > 0
    assert sum(red[::2]) == 0 and sum(red[1::2]) > 30


def test_more_than_100_robots(repository, tmp_path):
    """Message dots come with a key, robots are 8 pixels wide."""
    run = desim.run(desim.load(repository / "scenarios" / "maze_30.yaml", [
        "stop.elapsed=500 ms", "fleet.size=101",
        "fleet.start={apart: 1 m, within: [[-38 m, -38 m], [38 m, 38 m]]}"]), out=tmp_path)
    with opened(run, tmp_path) as browser:
        shown = """[desimReplay.app.layers.has("messages"),
                    document.querySelector("#layers input[name=messages]").checked]"""
        assert browser.value(shown) == [False, False]
        browser.key("m")
        assert browser.value(shown) == [True, True]
        browser.key("m")
        assert browser.value(shown) == [False, False]
        assert browser.complaints == []


def test_the_end_is_drawn(hello, tmp_path):
    """The clock and the button of a replay that has played to its end say so."""
    with opened(hello, tmp_path) as browser:
        assert browser.value("""new Promise((resolve) => {
            const { app } = desimReplay;
            app.seek(app.player.endS - 0.2);
            app.player.playing = true;
            const wait = () => app.player.playing ? requestAnimationFrame(wait)
                : requestAnimationFrame(() => resolve([document.querySelector("#now").textContent
                    === document.querySelector("#end").textContent,
                    document.querySelector("#play").ariaLabel]));
            wait(); })""") == [True, "play"]


def test_an_interrupted_run_says_so_once(repository, tmp_path):
    def watch(simulation, folder):
        simulation.kernel.at(2_000_000_000, Phase.OBSERVE, 1,
                             lambda _: simulation.interrupt())
        return nullcontext()

    with pytest.raises(KeyboardInterrupt) as ended:
        desim.run(repository / "scenarios" / "hello.yaml", out=tmp_path, watch=watch)
    run = Run(Path(str(ended.value)))
    with opened(run, tmp_path) as browser:
        head = browser.value("document.querySelector('#about').textContent")
    assert head == "seed 1  ·  testbed  ·  interrupted"


@pytest.mark.parametrize(("value", "shown"), [
    ("../../../apart:Apart", "apart:Apart"), ("/plug/ins/a.b:C", "a.b:C"), ("10 Mb/s", "10 Mb/s"),
    ("maps/one.yaml", "maps/one.yaml"), ("apart:Apart", "apart:Apart")])
def test_plug_ins_are_called_without_their_folders(value, shown):
    assert replay_page._PLACE.sub("", value) == shown
