"""A recording of real robots in a browser: rendered, scrubbed, its robots where they were."""

from __future__ import annotations

import numpy as np
import pytest
from devtools import Browser, chromium
from recorded import made, quiet

from desim.api import recording_of
from desim.report.replay.page import write
from desim.units import NS_PER_S

pytest.importorskip("rosbags", reason="rosbags is not installed")
from desim.export.ros.message_types import ODOMETRY, RosTypes  # noqa: E402
from desim.export.ros.recording_files import BagWriter, write_bag  # noqa: E402
from desim.imports.imported_run import import_recording  # noqa: E402


@pytest.fixture(scope="module")
def imported(repository, tmp_path_factory):
    folder = tmp_path_factory.mktemp("imported")
    run = made(repository, folder, "stop.elapsed=12 s")
    write_bag(recording_of(run), folder / "lab.bag", quiet)
    return recording_of(import_recording(folder / "lab.bag", folder).run), recording_of(run)


@pytest.fixture(scope="module")
def page(imported, tmp_path_factory):
    if chromium() is None:
        pytest.skip("there is no Chromium")
    folder = tmp_path_factory.mktemp("page")
    write(list(imported), folder / "both.html")
    write([imported[0]], folder / "one.html")
    with Browser(folder / "profile") as browser:
        yield browser, folder


def test_an_imported_bag_is_shown(imported, page):
    browser, folder = page
    browser.open(folder / "one.html")
    poses = imported[0].poses
    for k in (0, 50, len(poses.times_ns) - 1):
        browser.value(f"desimReplay.at({int(poses.times_ns[k]) / NS_PER_S!r})")
        found = np.array(browser.value("desimReplay.positions()"))
        assert (found[:, :2] == poses.xy_mm[k] / 1000).all()
    facts = browser.value("document.querySelector('#facts').textContent")
    assert "imported fromlab.bag" in facts
    assert browser.value("document.querySelector('#about').textContent") == "imported"
    # What it has not cannot be switched off: there are no scans.
    boxes = browser.value("[...document.querySelectorAll('#layers input')].map((box) => box.name)")
    assert "fans" not in boxes and {"map", "paths", "names"} <= set(boxes)
    assert browser.complaints == []


def test_odometry_alone_shows_no_shares(page, tmp_path):
    browser, _ = page
    types, path = RosTypes(1), tmp_path / "ways.bag"
    with BagWriter(path) as writer:
        topic = writer.add_connection("/odom", ODOMETRY, typestore=types.store)
        for k in range(5):
            writer.write(topic, k * NS_PER_S + 1, types.data(ODOMETRY, types.make(
                ODOMETRY, header=types.header(k * NS_PER_S + 1, "map"), pose=types.make(
                    "geometry_msgs/msg/PoseWithCovariance", pose=types.pose(k, 0.0, 0.0)))))
    write([recording_of(import_recording(path, tmp_path).run)], tmp_path / "ways.html")
    browser.open(tmp_path / "ways.html")
    browser.value("desimReplay.at(2)")
    browser.value("document.querySelector('#pick-robot').selectedIndex = 1")
    browser.value("document.querySelector('#pick-robot').onchange()")
    assert browser.value("document.querySelector('#charts').textContent").startswith("speed")
    assert "%" not in browser.value("document.body.innerText")
    assert "delivered" not in browser.value("document.body.innerText")
    assert browser.complaints == []


def test_beside_the_run_that_it_came_from(page):
    browser, folder = page
    browser.open(folder / "both.html")
    browser.value("desimReplay.at(6)")
    assert browser.value("document.querySelector('#about').textContent").startswith(
        "A: lab, imported  /  B: hello, seed 1")
    assert browser.complaints == []
