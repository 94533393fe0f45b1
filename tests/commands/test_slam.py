"""``desim slam``: what it prints, what it draws, what it refuses."""

import json
import textwrap

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
    (["--localization", "gps"], "--localization: unknown localization 'gps'; known: gmapping, "
                                "ground_truth, odometry, pose_graph, scan_matching, or a dotted "
                                "path"),
    (["--localization", "ground_truth"],
     "--localization: 'ground_truth' reads the true pose, which is in the simulator alone, and in "
     "no log; allowed: gmapping, odometry, pose_graph, scan_matching, or a plug-in "
     "'package.module:Class'\n"),
    (["--set", "particles=5"], "--set particles=5: is for plug-ins; gmapping has --particles and "
                               "--resolution\n"),
    (["--localization", "odometry", "--set", "drift"], "--set drift: must look like key=value\n"),
    (["--localization", "odometry", "--set", "drift=1"],
     "--set drift: unknown key; it has no parameters\n"),
    (["--localization", "scan_matching", "--particles", "50"],
     "--particles 50: scan_matching has none; allowed with gmapping\n"),
    (["--localization", "scan_matching", "--least-particles", "1"],
     "--least-particles 1: scan_matching has none; allowed with gmapping\n"),
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


PLUGIN = """
    from pydantic import Field

    from desim import ports
    from desim.ports import Pose2D
    from desim.ports.localization import LocalizationTraits
    from desim.robot.localization.kinds.ground_truth import GroundTruth


    class Scaled:
        class Params(ports.Params):
            scale: float = Field(1.0, gt=0, description="of the odometer's ways")

        def __init__(self, params):
            self.scale = params.scale

        def start(self, context):
            pass

        def on_odometry(self, context, odometry, sighting):
            return Pose2D(odometry.x_m * self.scale, odometry.y_m * self.scale, odometry.yaw_rad)


    class Broken(Scaled):
        def on_odometry(self, context, odometry, sighting):
            return odometry if context.now_ns < 2_100_000_000 else 1 / 0


    class Timid(Scaled):
        traits = LocalizationTraits(draws_map=True)


    class Cheat(GroundTruth):
        pass
"""


@pytest.fixture
def plugin(folder, tmp_path, monkeypatch):
    """The outcome of ``desim slam`` with a class of a module in the current directory."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "of_logs.py").write_text(textwrap.dedent(PLUGIN))
    return lambda name, *words: run(folder, "--localization", f"of_logs:{name}", *words)


def errors(done):
    assert done.exit_code == 0, done.output
    facts = json.loads(done.stdout)
    return facts, *(facts[key]["translation_m"]["mean"] if key else facts["translation_m"]["mean"]
                    for key in ("", "online", "odometry"))


def test_dead_reckoning_errs_as_the_odometry_does(folder):
    facts, final, online, odometry = errors(run(
        folder, "--relations", str(folder / "made.relations"), "--json", "--localization",
        "odometry"))
    assert final == online == odometry > 0.03
    assert (facts["particles"], facts["resampled"]) == (None, None)
    assert 15 < facts["processed"] < 30


def test_a_plug_in_with_a_parameter_runs_on_a_log(folder, plugin):
    words = "--relations", str(folder / "made.relations"), "--json"
    facts, final, _, odometry = errors(plugin("Scaled", *words, "--set", "scale=0.970874"))
    assert facts["localization"] == "of_logs:Scaled" and final < 0.8 * odometry  # made 3 % too long
    _, final, _, odometry = errors(plugin("Scaled", *words))
    assert final == odometry


def test_the_text_of_a_plug_in_has_no_particles(plugin):
    lines = plugin("Scaled").stdout.splitlines()
    assert lines[0] == "made.log: of_logs:Scaled, cells of 0.05 m, seed 1"
    assert lines[1].endswith("scans processed (181 beams)") and "particle" not in lines[2]


@pytest.mark.parametrize("name, words, code, says", [
    ("Broken", (), 1, "localization of_logs:Broken raised ZeroDivisionError: division by zero at "
                      "of_logs.py:26 (2.2 s)\n"),
    ("Timid", (), 1, "of_logs:Timid drew none of 207 scans; wanted: some, as its traits say "
                     "draws_map\n"),
    ("Cheat", (), 2, "--localization: 'of_logs:Cheat' reads the true pose, which is in the "),
    ("Scaled", ("--set", "scale=-1"), 2, "--set scale: must be above 0, got -1"),
])
def test_a_plug_in_that_goes_wrong_is_named(plugin, name, words, code, says):
    done = plugin(name, *words)
    assert (done.exit_code, done.stderr.startswith(says)) == (code, True), done.stderr


def jumped(folder, metres):
    """The log with odometry that is so far away in its last scan."""
    lines = (folder / "made.log").read_text().splitlines()
    last = max(k for k, line in enumerate(lines) if line.startswith("FLASER"))
    words = lines[last].split()
    for at in (-9, -6):  # x of the laser's pose, and of the robot's
        words[at] = str(float(words[at]) + metres)
    (folder / "jumped.log").write_text("\n".join([*lines[:last], " ".join(words)]) + "\n")
    return folder / "jumped.log", last + 1


def test_a_jump_of_the_odometry_is_warned_of_and_takes_no_memory_to_speak_of(folder):
    log, line = jumped(folder, 300.0)
    done = CliRunner().invoke(app, ["slam", str(log), "--localization", "scan_matching",
                                    "--resolution", "0.1", "--to", str(folder / "jumped.png")])
    assert done.exit_code == 0, done.output
    assert done.stderr.startswith(f"warning: {log}:{line}: the odometry moves ")
    assert done.stderr.count("; 1 such jump in the log\n") == 1


def test_a_map_that_does_not_fit_into_memory_is_refused_by_its_cells(folder):
    log, _ = jumped(folder, 90_000.0)
    done = CliRunner().invoke(app, ["slam", str(log), "--to", str(folder / "jumped.png")])
    assert done.exit_code == 2
    assert done.stderr.splitlines()[1:] == [
        f"{log}: the map is 90035 m x 34.145 m large by its odometry; in cells of 0.05 m it takes "
        "15371 MB; allowed: up to 1000 MB, with --resolution 0.2"]


def test_a_folder_in_place_of_a_log_is_named_as_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, ["slam", "."])
    assert done.exit_code == 2
    assert done.output == ".: Is a directory\n"
