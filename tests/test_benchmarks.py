"""Benchmarks: the file of measurements, and the shares of the time of SLAM."""

from __future__ import annotations

import subprocess
import sys

import pytest
from benchmarks import history, robots
from slam_logs import made_log, ring, way

from desim.robot.slam.kinds import gmapping
from desim.robot.slam.settings import SlamSettings

FOUND = [("6e12754", "scenarios: hello", 0.00312345), ("4c4582f", "scenarios: hello", 0.005)]


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.setattr(history, "commit_of", lambda revision: (revision, "2026-11-23"))
    return tmp_path / "benchmarks.csv"


def test_what_is_added_is_read_again_oldest_first(file):
    history.add("2026-11-23", "a CPU, of some kind", 0.54, FOUND, file)
    history.add("2026-11-24", "another", 0.5, [("6e12754", "scenarios: hello", 0.002)], file)
    rows = history.read(file)
    assert [(row["measured"], row["cpu"], row["commit"], row["cost"]) for row in rows] == [
        ("2026-11-23", "a CPU, of some kind", "6e12754", "0.003123"),
        ("2026-11-23", "a CPU, of some kind", "4c4582f", "0.005"),
        ("2026-11-24", "another", "6e12754", "0.002")]
    assert history.table(rows) == [
        {"what": "scenarios: hello", "6e12754": "0.002", "4c4582f": "0.005"}]


def test_there_may_be_no_file(file):
    assert history.read(file) == []


def test_a_file_with_other_columns_is_refused(file):
    file.write_text("commit,cost\n")
    with pytest.raises(SystemExit, match="has columns .'commit', 'cost'., wanted: "):
        history.read(file)


def test_a_commit_that_git_does_not_know_is_refused():
    with pytest.raises(SystemExit, match="^history: .*no-such-commit"):
        history.commit_of("no-such-commit")


def test_the_help_names_all_that_bench_can_do(repository):
    done = subprocess.run([sys.executable, repository / "tools" / "bench.py", "--help"], text=True,
                          capture_output=True, check=True)
    for form in ("fleets --figure FILE", "compare REV [--turns N]", "history [REV ...]", "beacons",
                 "robots"):
        assert form in done.stdout


@pytest.fixture
def short_log():
    poses = way([(1.2, 1.2), (6.0, 1.2)])
    return robots.Setting("short", made_log(ring(14.0, 10.0, 2.5), poses), 0.2)


def test_each_kernel_has_its_share_of_a_scan_s_time(short_log):
    log = short_log.log
    chosen = SlamSettings(resolution_m=0.2, laser=log.laser)
    found = robots.parts(lambda: gmapping(chosen, 1), log)
    shares = dict(part.rsplit(" ", 1) for part in found.split(", "))
    assert {"propose", "search", "register_all", "Python"} <= shares.keys()
    assert abs(sum(map(int, shares.values())) - 100) <= len(shares)


def test_who_measures_for_minutes_says_what(short_log, monkeypatch, capsys):
    monkeypatch.setattr(robots, "settings", lambda reference: [short_log])
    monkeypatch.setattr(robots, "TURNS", 1)
    assert len(robots.scans(None)) == 2
    assert capsys.readouterr().err.splitlines() == [
        "measuring short, gmapping: 1 plays", "measuring short, scan_matching: 1 plays"]


def test_timers_are_gone_afterwards():
    before = robots.particle_filter.propose
    with robots.timed_kernels():
        assert robots.particle_filter.propose is not before
    assert robots.particle_filter.propose is before


def test_every_second_beam_is_where_it_was(short_log):
    log = short_log.log
    half = robots.every_second_beam(log)
    assert half.ranges.shape[1] == log.ranges.shape[1] // 2
    angle = log.laser.angle_min_rad + 2 * 7 * log.laser.increment_rad
    assert half.laser.angle_min_rad + 7 * half.laser.increment_rad == pytest.approx(angle)
    assert (half.ranges[:, 7] == log.ranges[:, 14]).all()


def test_without_the_real_log_the_made_one_is_left(tmp_path):
    assert [setting.name for setting in robots.settings(tmp_path)] == [
        "made ring, 180 beams, 0.2 m"]
