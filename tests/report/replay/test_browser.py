"""The replay in a browser: what it draws, where its robots are, what keys and fingers do."""

import numpy as np
import pytest
from devtools import Browser

from desim.api import recording_of
from desim.report.replay.page import write
from desim.units import NS_PER_S

pytestmark = pytest.mark.usefixtures("browser_here")


@pytest.fixture(scope="module")
def page(browser_here, tmp_path_factory, replay):
    with Browser(tmp_path_factory.mktemp("profile")) as browser:
        browser.open(replay)
        yield browser


@pytest.fixture(autouse=True)
def from_the_start(request):
    if "page" in request.fixturenames:
        page = request.getfixturevalue("page")
        page.value("desimReplay.at(0); desimReplay.select({})")
        yield
        assert page.complaints == []
    else:
        yield


# The first pane's sheets, put together.
PICTURE = """(() => {
    const sheets = [...document.querySelector(".pane").querySelectorAll("canvas")];
    const canvas = document.createElement("canvas"), context = canvas.getContext("2d");
    [canvas.width, canvas.height] = [sheets[0].width, sheets[0].height];
    for (const sheet of sheets) context.drawImage(sheet, 0, 0);
    return canvas; })()"""


def colours(page):
    """The number of different colours of the scene."""
    return page.value(f"""(() => {{
        const canvas = {PICTURE};
        const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
        return new Set(new Uint32Array(data.buffer)).size; }})()""")


def test_positions_are_those_of_the_recording(page, hello):
    poses = recording_of(hello).poses
    for k in (0, 1, 57, 200, len(poses.times_ns) - 1):
        page.value(f"desimReplay.at({int(poses.times_ns[k]) / NS_PER_S!r})")
        found = np.array(page.value("desimReplay.positions()"))
        assert (found[:, :2] == poses.xy_mm[k] / 1000).all()
        assert (found[:, 2] == poses.yaw_mrad[k] / 1000).all()


def test_between_two_samples_it_is_on_the_line(page, hello):
    poses = recording_of(hello).poses
    at_ns = int(poses.times_ns[100:102].mean())
    page.value(f"desimReplay.at({at_ns / NS_PER_S!r})")
    found = np.array(page.value("desimReplay.positions()"))
    assert np.abs(found - poses.at(at_ns)).max() < 1e-6


def test_the_scene_is_drawn_and_changes(page):
    page.value("desimReplay.at(5)")
    assert colours(page) > 100
    shot = f"{PICTURE}.toDataURL()"
    before = page.value(shot)
    page.value("desimReplay.at(30)")
    after = page.value(shot)
    assert before != after
    page.value("desimReplay.at(5)")
    assert page.value(shot) == before


def test_a_robot_is_selected_by_a_click(page):
    x, y = page.value("""(() => {
        const { stage } = desimReplay.app, box = stage.element.getBoundingClientRect();
        const [x, y] = desimReplay.positions()[1];
        return [box.left + stage.camera.sx(x), box.top + stage.camera.sy(y)]; })()""")
    page.click(x, y)
    assert page.value("desimReplay.selection()") == {"kind": "robot", "robot": 1}
    page.value("desimReplay.draw()")
    assert page.value("document.querySelector('#selection h2').textContent") == "robot_1"
    assert page.value("document.querySelectorAll('.chart').length") == 3
    page.key("Escape")
    assert page.value("desimReplay.selection()") == {}


def test_a_robot_below_the_mouse_is_named(page):
    page.value("desimReplay.at(20)")
    x, y = page.value("""(() => {
        const { stage } = desimReplay.app, box = stage.element.getBoundingClientRect();
        const [x, y] = desimReplay.positions()[0];
        return [box.left + stage.camera.sx(x), box.top + stage.camera.sy(y)]; })()""")
    page("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
    page.value("desimReplay.draw()")
    assert page.value("document.querySelector('.hint-text').textContent").startswith(
        "robot_0: knows ")
    page("Input.dispatchMouseEvent", type="mouseMoved", x=5, y=5)
    page.value("desimReplay.draw()")
    assert page.value("document.querySelector('.hint-text').hidden")


def test_a_message_is_selected_in_the_list(page):
    page.value("desimReplay.at(20); desimReplay.select({kind: 'robot', robot: 2})")
    page.value("desimReplay.draw()")
    items = "[...document.querySelectorAll('#messages li')]"
    words = page.value(f"{items}.map((item) => item.querySelector('span').textContent)")
    assert len(words) == 7
    assert all(word.startswith("2 → ") or " → 2  " in word for word in words)
    page.value(f"{items}[0].querySelector('button').click()")
    page.value("desimReplay.draw()")
    assert page.value("desimReplay.selection().kind") == "message"
    story = page.value("document.querySelector('#message').textContent")
    assert "before its first frame" in story and "The parts: desim why RUN --message " in story


def test_the_loads_of_all_topics_are_pale_below_one(page):
    """Only widths and opacities of loads are looked at: the messages of topics are dots."""
    drawn = """(() => {
        const { app } = desimReplay, [scene] = app.scenes, strokes = [];
        const context = new Proxy({}, {
            get: (own, name) => name === "stroke"
                ? () => strokes.push(own.lineWidth * own.globalAlpha) : own[name] ?? (() => {}),
            set: (own, name, value) => { own[name] = value; return true; } });
        const selected = Object.values(app.selection).join();
        scene.loads.draw(context, app.stage.camera,
            { timeS: 20, theme: app.theme, selection: app.selection, selected });
        return strokes; })()"""
    page.value("desimReplay.at(20)")
    whole = page.value(drawn)
    page.value("desimReplay.select({kind: 'family', family: 1}); desimReplay.draw()")
    pale = page.value(drawn)
    assert len(whole) > 0
    assert pale == pytest.approx([0.35 * ink for ink in whole])
    assert page.value("""document.querySelector('.caption').textContent.endsWith(
        `messages of ${desimReplay.app.runs[0].about.families[1]}`)""")


def test_the_share_explored_grows_as_the_picture_does(page, hello):
    table = recording_of(hello).run.robots
    share = dict(zip(table["time_s"].tolist(), table["explored_union"].tolist(), strict=True))
    found = page.value("""[0, 0.3, 0.6, 1, 7, 7.5, 8].map((at) => {
        desimReplay.at(at);
        const { starts, last } = desimReplay.app.scenes[0].growth.merged;
        return [parseFloat(document.querySelector(".caption").textContent),
            parseFloat(document.querySelector(".chart i").textContent.match(/[0-9.]+/)[0]),
            starts[Math.min(Math.floor(10 * at + 1e-6), last) + 1]]; })""")
    assert all(caption == chart for caption, chart, _ in found)
    one, other = found[4], found[6]
    between = one[0] + (other[0] - one[0]) * (found[5][2] - one[2]) / (other[2] - one[2])
    assert found[5][0] == pytest.approx(between, abs=0.15)
    for k, at_s in ((3, 1.0), (4, 7.0), (6, 8.0)):
        assert found[k][0] == pytest.approx(100 * share[at_s], abs=0.06)
    # Recorded before the first scans, of which the picture has the cells.
    assert share[0.0] == 0
    for k in (0, 1, 2):
        assert found[k][0] == pytest.approx(100 * share[1.0] * found[k][2] / found[3][2], abs=0.06)


def test_charts_name_the_ends_of_their_scales(page):
    ends = page.value("[...document.querySelectorAll('.chart small')].map((o) => o.textContent)")
    assert ends[0] == "0 to 100.0 %"
    assert ends[1].endswith("kB/s, logarithmic")
    assert page.value("document.querySelector('#curves').textContent").startswith(
        "line: explored, 0 to 100 %  ·  grey: delivered, at most ")


def test_keys(page):
    page.key("ArrowRight")
    page.key("ArrowRight", shift=True)
    page.key(".")
    assert page.value("desimReplay.time()") == pytest.approx(11.1)
    page.key("End")
    assert page.value("desimReplay.time() === desimReplay.span()[1]")
    page.key("[")
    assert page.value("desimReplay.time() < desimReplay.span()[1]")
    page.key("Home")
    page.key(" ")
    assert page.value("desimReplay.playing()")
    page.key(" ")
    assert not page.value("desimReplay.playing()")
    page.key("n")
    assert page.value("desimReplay.selection()") == {"kind": "robot", "robot": 0}
    page.key("?")
    assert page.value("document.querySelector('#help').open")
    page.key("?")
    assert not page.value("document.querySelector('#help').open")
    for _ in range(2):
        before = page.value("document.documentElement.dataset.theme")
        page.key("t")
        assert page.value("document.documentElement.dataset.theme") != before


def test_the_help_has_the_symbols_in_the_colours_of_the_theme(page):
    pictures = """[...document.querySelectorAll("#symbol-list canvas")].map(
        (canvas) => canvas.toDataURL())"""
    page.key("?")
    light = page.value(pictures)
    words = page.value(
        "[...document.querySelectorAll('#symbol-list dd')].map((one) => one.textContent)")
    page.key("?")
    page.key("t")
    dark = page.value(pictures)
    page.key("t")
    assert len(light) == len(words) == len(set(words)) > 25
    assert len(set(light)) == len(light)
    assert not set(light) & set(dark)
    assert {"plan, and the goal at its end", "message that was lost"} <= set(words)


def test_only_what_has_changed_is_drawn_again(page):
    """At the same instant only the sheets of fans and of what moves."""
    drawn = page.value("""(() => {
        const [pane] = desimReplay.app.stage.panes, drawn = [];
        desimReplay.at(20);
        pane.sheets.layers.forEach(({ canvas }, k) => {
            const context = canvas.getContext("2d"), { clearRect } = context;
            context.clearRect = (...box) => { drawn.push(k); clearRect.apply(context, box); };
        });
        const counts = [20, 20, 25].map((at) => {
            drawn.length = 0;
            desimReplay.at(at);
            return [...drawn];
        });
        for (const { canvas } of pane.sheets.layers) delete canvas.getContext("2d").clearRect;
        return counts; })()""")
    assert drawn[0] == drawn[1] == [1, 6]
    # Five seconds later all but the terrain, on which the paths have grown.
    assert drawn[2] == [0, 1, 3, 4, 5, 6]


def test_a_phone_shows_it_without_scrolling_sideways(tmp_path, replay):
    with Browser(tmp_path / "profile", width=390, height=844, touch=True) as page:
        page.open(replay)
        page.value("desimReplay.at(20)")
        assert page.value("document.documentElement.scrollWidth") == 390
        assert colours(page) > 100
        assert page.complaints == []


def test_dark_where_the_computer_is(tmp_path, replay):
    with Browser(tmp_path / "profile", scheme="dark") as page:
        page.open(replay)
        assert page.value("document.documentElement.dataset.theme") == "dark"


def test_two_runs_of_different_fleets(tmp_path, hello, repository):
    """A selection in one is that of the same name in the other, if that has it."""
    import desim

    other = desim.run(desim.load(repository / "scenarios" / "hello.yaml", [
        "fleet.size=2", "stop.elapsed=5 s", "deployment=field"]), out=tmp_path)
    both = tmp_path / "both.html"
    write([recording_of(other), recording_of(hello)], both)
    with Browser(tmp_path / "profile") as page:
        page.open(both)
        for what in ("{kind: 'robot', robot: 1}", "{kind: 'family', family: 0}",
                     "{kind: 'link', one: 0, other: 1}", "{kind: 'message', message: 0}", "{}"):
            for mode in ("ghost", "side"):
                page.value(f"desimReplay.mode('{mode}'); desimReplay.select({what}); "
                           "desimReplay.at(20)")
        assert page.complaints == []


def test_two_runs(tmp_path, hello, repository):
    import desim

    other = desim.run(desim.load(repository / "scenarios" / "hello.yaml", seed=2), out=tmp_path)
    recordings = [recording_of(hello), recording_of(other)]
    both = tmp_path / "both.html"
    write(recordings, both)
    with Browser(tmp_path / "profile") as page:
        page.open(both)
        assert page.value("document.querySelectorAll('.pane').length") == 2
        one, two = (recording.poses for recording in recordings)
        count = min(len(one.times_ns), len(two.times_ns))
        apart = np.linalg.norm((one.xy_mm[:count] - two.xy_mm[:count]).astype(float), axis=2) > 1
        first = int(one.times_ns[apart.any(axis=1).argmax()]) / NS_PER_S
        assert page.value("desimReplay.difference().timeS") == first
        page.value("desimReplay.at(20)")
        for which, poses in enumerate((one, two)):
            found = np.array(page.value(f"desimReplay.positions({which})"))
            assert np.abs(found - poses.at(20 * NS_PER_S)).max() < 1e-6
        page.key("g")
        page.value("desimReplay.draw()")
        assert page.value("desimReplay.mode()") == "ghost"
        assert page.value("document.querySelectorAll('.pane').length") == 1
        caption = page.value("document.querySelector('.caption').textContent")
        assert caption.startswith("A: seed 1  /  B: seed 2 (hollow)  ·  ")
        # What both have in common is said once.
        assert page.value("document.querySelector('#about').textContent") == (
            "testbed  ·  explored  ·  A: seed 1  /  B: seed 2")
        assert page.complaints == []
