"""``desim slam``: what it prints, what it draws, what it refuses."""

import json

import numpy as np
import pytest
from slam_logs import carmen_text, made_log, ring, way
from typer.testing import CliRunner

from desim.cli import app
from desim.robot.transforms import motion_between


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A log, and its true relations from each scan to the tenth after it."""
    place = tmp_path_factory.mktemp("log")
    poses = way([(1.2, 1.2), (12.8, 1.2), (12.8, 8.8)])
    log = made_log(ring(14.0, 10.0, 2.5), poses)
    (place / "made.log").write_text(carmen_text(log))
    true = motion_between(poses[:-10], poses[10:])
    (place / "made.relations").write_text("".join(
        f"{log.times_s[k]:.5f} {log.times_s[k + 10]:.5f} {x:.5f} {y:.5f} 0 0 0 {yaw:.5f}\n"
        for k, (x, y, yaw) in enumerate(true)))
    return place


def _lines(folder):
    return len((folder / "made.log").read_text().splitlines())


def run(folder, *words):
    return CliRunner().invoke(app, ["slam", str(folder / "made.log"), "--to",
                                    str(folder / "map.png"), *words])


def test_the_json_has_errors_costs_and_counts(folder):
    done = run(folder, "--relations", str(folder / "made.relations"), "--json", "--particles", "5")
    assert done.exit_code == 0, done.output
    facts = json.loads(done.stdout)
    assert facts["localization"] == "gmapping" and facts["particles"] == 5
    assert (facts["scans"], facts["beams"]) == (_lines(folder) // 2, 181)
    assert 15 < facts["processed"] < 30 and facts["cpu_ms_per_scan"] > 0.0
    assert set(facts["translation_m"]) == {"mean", "std", "max"} == set(facts["rotation_deg"])
    assert facts["translation_m"]["mean"] < 0.03 < facts["odometry"]["translation_m"]["mean"]
    assert facts["rotation_deg"]["mean"] < 1.0
    assert facts["translation_m"]["mean"] < facts["online"]["translation_m"]["mean"] < 0.1
    assert (folder / "map.png").read_bytes().startswith(b"\x89PNG")


def test_the_text_has_them_too(folder):
    done = run(folder, "--relations", str(folder / "made.relations"), "--localization",
               "scan_matching")
    lines = done.stdout.splitlines()
    assert lines[0] == "made.log: scan_matching, 1 particle, cells of 0.05 m"
    assert "scans processed (181 beams)" in lines[1] and "ms a processed scan" in lines[2]
    assert [line.split()[0] for line in lines[4:7]] == ["final", "online", "odometry"]
    assert np.isfinite(float(lines[4].split()[2]))


@pytest.mark.parametrize("words, message", [
    (["--localization", "gps"], "'gps' is not one of 'gmapping', 'scan_matching'"),
    (["--to", "map.txt"], "--to: map.txt does not end like a picture; allowed: .png, .pdf, .svg"),
    (["--particles", "0"], "Invalid value for '--particles'")])
def test_a_wrong_option_is_refused(folder, words, message):
    done = run(folder, *words)
    assert done.exit_code == 2 and message in done.stderr


def test_a_wrong_file_is_refused(folder, tmp_path):
    wrong = tmp_path / "a.relations"
    wrong.write_text("1 2 3\n")
    done = run(folder, "--relations", str(wrong))
    assert (done.exit_code, done.stderr) == (
        2, f"{wrong}:1: has 3 values; wanted: t1 t2 x y z roll pitch yaw\n")
