"""Of a robot's sensors: lasers that look over a low wall, a sonar, and a bumper."""

import numpy as np
import pytest
from devtools import Browser
from test_bundle import columns_of

import desim
from desim.api import recording_of
from desim.export.ros.laser_scans import Scanner
from desim.report.replay.page import write
from desim.results.contacts import contacts
from desim.units import NS_PER_S

SIDEWAYS = "[[0 m, 0.136 m, 90 deg], [0 m, -0.136 m, -90 deg], [-0.1 m, 0 m, 180 deg]]"


@pytest.fixture(scope="module")
def felt(tmp_path_factory, repository):
    """A run in which the mapper meets a low wall, which its lasers do not see, nor its sonar, which
    looks to the sides and behind."""
    return desim.run(repository / "scenarios/two_types.yaml", overrides=[
        "fleet.robots=[{type: mapper, count: 1}]", "fleet.start={poses: [{x: -8 m, y: -4 m}]}",
        "fleet.types.mapper.robot.lasers.low.height=0.6 m", "robot.bumper=true",
        f"robot.sonar={{transducers: {SIDEWAYS}, max_range: 4.5 m}}", "stop.elapsed=20 s"],
        out=tmp_path_factory.mktemp("felt"))


def test_the_bundle_has_all_sensors(felt):
    about, found = columns_of(felt)
    assert [laser["height_m"] for laser in about["lasers"][0]] == [0.6, 0.6]
    [sonar] = about["sonars"]
    assert (sonar["range_m"], sonar["height_m"], len(sonar["mounts"])) == (4.5, 0.2, 3)
    assert sonar["mounts"][0] == pytest.approx([0.0, 0.136, np.pi / 2])
    assert about["bumpers"] == [True]
    bumps = [(time_ns, 0) for time_ns, robot in contacts(recording_of(felt)) if robot == "robot_0"]
    assert bumps and list(zip(found["bump.ns"][0], found["bump.robot"][0], strict=True)) == bumps


def test_a_robot_without_a_bumper_has_no_bumps(felt, repository, tmp_path):
    without = desim.run(repository / "scenarios/two_types.yaml", overrides=[
        "fleet.robots=[{type: mapper, count: 1}]", "fleet.start={poses: [{x: -8 m, y: -4 m}]}",
        "fleet.types.mapper.robot.lasers.low.height=0.6 m", "stop.elapsed=20 s"], out=tmp_path)
    assert list(contacts(recording_of(without)))
    about, found = columns_of(without)
    assert about["bumpers"] == [False] and about["sonars"] == [None]
    assert found["bump.ns"].size == 0


@pytest.fixture(scope="module")
def page(browser_here, tmp_path_factory, felt):
    """Its replay in a browser."""
    file = tmp_path_factory.mktemp("page") / "replay.html"
    write([recording_of(felt)], file)
    with Browser(tmp_path_factory.mktemp("profile")) as browser:
        browser.open(file)
        yield browser
        assert browser.complaints == []


def test_the_page_reads_sonars_as_the_run_did(page, felt):
    recording = recording_of(felt)
    scanner = Scanner(felt.scenario)
    for k in (0, 60, 120, 180, len(recording.poses.times_ns) - 1):
        page.value(f"desimReplay.at({int(recording.poses.times_ns[k]) / NS_PER_S!r})")
        [expected] = scanner.sonar_m(recording, k, [0])
        [found] = page.value("desimReplay.sonars()")
        assert found == pytest.approx(np.minimum(expected, 4.5).tolist(), abs=0.002)
    assert min(found) < 4.5


def drawn(page, layer):
    """Whether the scene has other pixels without a layer."""
    picture = ("[...document.querySelector('.pane').querySelectorAll('canvas')]"
               ".map((sheet) => sheet.toDataURL()).join()")
    toggle = "desimReplay.app.layers"
    with_it = page.value(f"desimReplay.draw(), {picture}")
    without = page.value(f"{toggle}.delete('{layer}'), desimReplay.draw(), {picture}")
    page.value(f"{toggle}.add('{layer}'), desimReplay.draw()")
    return with_it != without


def test_sonars_and_bumps_are_drawn(page, felt):
    (begin_ns, _), *_ = contacts(recording_of(felt))
    page.value("desimReplay.at(3)")
    assert drawn(page, "nearby")
    page.value("desimReplay.app.scenes[0].run.about.sonars[0] = null")
    assert not drawn(page, "nearby")
    page.value(f"desimReplay.at({begin_ns / NS_PER_S + 0.2!r})")
    assert drawn(page, "nearby")
    page.value(f"desimReplay.at({begin_ns / NS_PER_S - 0.2!r})")
    assert not drawn(page, "nearby")


def test_laser_fans_go_over_low_walls(page):
    """From (-8, -4) a beam to the right meets the wall at -2 m, 0.3 m high, below 0.3 m alone."""
    cast = "desimReplay.app.scenes[0].terrain.raysAt(0, {}).cast(-8, -4, 1, 0, 26)"
    assert page.value(cast.format(0.29)) == pytest.approx(6.0)
    assert page.value(cast.format(0.6)) == pytest.approx(14.0)
