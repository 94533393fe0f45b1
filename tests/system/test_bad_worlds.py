"""Scenarios that are wrong only where the parts meet, and runs that are cut off.

Through the real command line, with the message in full.
"""

import json
import os
import pty
import re
import signal
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image
from runs import MAZE_30
from typer.testing import CliRunner

from desim import api
from desim.cli import app
from desim.errors import InputError
from desim.results.run import Run

MAZE = "allowed: x from -40 to 40 m, y from -40 to 40 m"
AREA = ("allowed: x between -40 and 40 m, y between -40 and 40 m, the edges themselves "
        "left out")
IN_WALL = ("m lies in a wall or closer to one than its radius of 0.26 m; allowed: a free place, or "
           "start.snap: true to move it to the nearest one")
APART = ("allowed: at least 0.52 m apart, or start.snap: true to move it to the nearest free place")
NO_CELL = ("can be reached from the start positions; use a finer mapping resolution or other "
           "starts")
BESIDE = ("images beside it: empty.pgm, grey.pgm, notes.pgm, room.pgm; `image:` in the scenario's "
          "terrain overrides the one that the YAML names")

# What follows "name: x\n", and the complaint without "case.yaml:" in front.
WORLDS = {
    "robot in a wall": ("fleet: {start: {from: [-39.9 m, 38 m]}}",
                        f"2:16: fleet.start: the start of robot_0 at (-39.9, 38) {IN_WALL}"),
    "robot in a block": ("environment: {terrain: loop}\nfleet: {start: {from: [0 m, 0 m]}}",
                         f"3:16: fleet.start: the start of robot_0 at (0, 0) {IN_WALL}"),
    "robot in a closed door": (
        "environment: {doors: [{from: [-40 m, 38 m], to: [-32 m, 38 m]}]}",
        f"1:1: fleet.start: the start of robot_0 at (-38, 38) {IN_WALL}"),
    "two robots in one place": (
        "fleet: {size: 2, start: {step: [0 m, -0.4 m]}}",
        "2:25: fleet.start: the start of robot_1 at (-38, 37.6) m is 0.4 m from that of robot_0 at "
        f"(-38, 38) m; {APART}"),
    "two poses in one place": (
        "fleet: {start: {poses: [{name: b, x: 0 m, y: 1 m}, {name: a, x: 0 m, y: 1 m}]}}",
        "2:16: fleet.start: the start of b at (0, 1) m is 0 m from that of a at (0, 1) m; "
        f"{APART}"),
    "start outside": (
        "fleet: {start: {from: [-41 m, 38 m]}}",
        f"2:16: fleet.start: the start of robot_0 at (-41, 38) m lies outside the terrain; {AREA}"),
    "a fleet longer than the terrain": (
        "fleet: {size: 41}",
        f"2:1: fleet.start: the start of robot_39 at (-38, -40) m lies outside the terrain; {AREA}"
    ),
    "the paper's start in another terrain": (
        "environment: {terrain: {size: [20 m, 20 m]}}",
        "1:1: fleet.start: the start of robot_0 at (-38, 38) m lies outside the terrain; allowed: "
        "x between -10 and 10 m, y between -10 and 10 m, the edges themselves left out"),
    "no room for the fleet": (
        "environment: {terrain: {size: [1 m, 1 m]}}\n"
        "fleet: {size: 5, start: {from: [0 m, 0 m], step: [0 m, 0 m], snap: true}}",
        "3:25: fleet.start: no free place for robot_1 with a radius of 0.26 m anywhere in terrain "
        "'shape'"),
    "no room in a solid terrain": (
        "environment: {terrain: {size: [8 m, 8 m], drawing: {lines: ['#'], style: blocks}}}\n"
        "fleet: {start: {from: [0 m, 0 m], snap: true}}",
        "3:16: fleet.start: no free place for robot_0 with a radius of 0.26 m anywhere in terrain "
        "'shape'"),
    "unreachable terrain": (
        "robot: {mapping: {resolution: 50 m}}",
        f"1:1: environment.terrain: no free cell of 50.0 m of 'maze' {NO_CELL}"),
    "too many cells": (
        "robot: {mapping: {resolution: 1 mm}}",
        "2:31: robot.mapping.resolution: 80001 x 80001 cells of 0.001 m are too many for terrain "
        "'maze' (allowed: 64000000)"),
    "obstacle through a wall": (
        "environment: {moving_obstacles: [{path: [[-38 m, 36 m], [30 m, -38 m]]}]}",
        "2:41: environment.moving_obstacles.0.path: crosses a wall or leaves the terrain, or comes "
        "closer to a wall than its radius of 0.3 m"),
    "obstacle wider than the road": (
        "environment: {moving_obstacles: [{path: [[-36 m, 36 m], [-36 m, 20 m]], radius: 5 m}]}",
        "2:41: environment.moving_obstacles.0.path: crosses a wall or leaves the terrain, or comes "
        "closer to a wall than its radius of 5 m"),
    "obstacle too fast for the tick": (
        "environment: {moving_obstacles: [{path: [[-36 m, 36 m], [-36 m, 20 m]], speed: 36 km/h}]}",
        "2:80: environment.moving_obstacles.0.speed: at 10 m/s it covers 0.166667 m in a tick and "
        "could pass through robots and closed doors; allowed: half its radius (0.15 m) a tick, at "
        "most 9 m/s"),
    "door without width": (
        "environment: {doors: [{from: [1 m, 0 m], to: [1 m, 0 m]}]}",
        "2:23: environment.doors.0: it starts and ends at (1, 0) m"),
    "door outside": (
        "environment: {doors: [{from: [1 m, 0 m], to: [99 m, 0 m]}]}",
        f"2:23: environment.doors.0: (99, 0) m lies outside the terrain; {MAZE}"),
    "rectangle outside": (
        "environment: {terrain: {size: [9 m, 9 m], rectangles: [{x: [0 m, 9 m], y: [0 m, 1 m]}]}}",
        "2:56: environment.terrain.rectangles.0: (9, 1) m lies outside the terrain; allowed: x "
        "from -4.5 to 4.5 m, y from -4.5 to 4.5 m"),
    "wall of unknown material": (
        "environment: {terrain: {size: [9 m, 9 m], walls: "
        "[{from: [1 m, 1 m], to: [1 m, 2 m], material: woood}]}}",
        "2:96: environment.terrain.walls.0.material: unknown material 'woood' (did you mean "
        "'wood'?); allowed: brick, concrete, glass, metal, plasterboard, stone, wood"),
    "terrain without end": (
        "environment: {terrain: {size: [200 km, 5 m]}}",
        "2:31: environment.terrain.size: the terrain is 200000 m by 5 m; allowed: at most 10000 m "
        "a side"),
    "drawing of another size": (
        "environment: {terrain: {size: [10 m, 8 m], drawing: {lines: [+--+, '|  |', +--+]}}}",
        "2:53: environment.terrain.drawing: it is 1 cell of 8 m wide, 8 m, but size[0] is 10 m"),
    "partition of nobody": (
        "network: {media: {lan: {model: ideal, rules: [{rule: partition, groups: [['robt_*']]}]}}}",
        "2:75: network.media.lan.rules.0.groups.0.0: 'robt_*' names no host (did you mean "
        "'robot_0'?); hosts are robot_0, workstation"),
    "a host in two parts": (
        "network: {media: {lan: {model: link, rules: [{rule: loss, probability: 1 %}, "
        "{rule: partition, groups: [[robot_0], ['robot_*']]}]}}}",
        "2:117: network.media.lan.rules.1.groups.1.0: host 'robot_0' is in more than one group"),
    "a port of nobody": (
        "network: {media: {lan: {model: switch, ports: {p: [robt_0]}}}}",
        "2:51: network.media.lan.ports.p: no host 'robt_0' (did you mean 'robot_0'?); hosts are "
        "robot_0, workstation"),
    "a host on two ports": (
        "network: {media: {lan: {model: switch, ports: {p: [robot_0], q: [robot_0]}}}}",
        "2:65: network.media.lan.ports.q: host 'robot_0' has a port already"),
}

# The map of a terrain: what is changed in a good one, and the complaint after its path.
MAPS = {
    "missing image": ("image: nowhere.pgm",
                      f": its image 'nowhere.pgm' does not exist; {BESIDE}"),
    "text instead of an image": (
        "image: notes.pgm", "notes.pgm: cannot be read as an image: cannot identify image file "
                            "'{here}/notes.pgm'"),
    "empty image": (
        "image: empty.pgm", "empty.pgm: cannot be read as an image: cannot identify image file "
                            "'{here}/empty.pgm'"),
    "nothing free": ("image: grey.pgm", "grey.pgm: no free cell (see free_thresh, negate and "
                                        "mode in map.yaml)"),
    "a threshold in percent": (
        "occupied_thresh: 65", ": occupied_thresh must lie between 0 and 1, got 65"),
    "negative resolution": ("resolution: -0.05", ": resolution must be above zero, got -0.05"),
    "resolution that is no number": (
        "resolution: fine", ": resolution must be a number, got 'fine'"),
    "NaN": ("resolution: .nan", ": resolution must be above zero, got nan"),
    "half an origin": ("origin: [0, 0]", ": origin must be [x, y, yaw], got [0, 0]"),
    "negate": ("negate: maybe", ": negate must be a number, got 'maybe'"),
    "another mode": ("mode: cooked", ": unknown mode 'cooked'; allowed: trinary, scale, raw"),
}
GOOD_MAP = {"image": "room.pgm", "resolution": "0.5", "origin": "[-5, -5, 0]", "negate": "0",
            "occupied_thresh": "0.65", "free_thresh": "0.196"}
WHOLE_MAPS = {
    "a list": ("- a\n", ": not a map_server file; its keys are image, resolution, origin, negate, "
                        "occupied_thresh, free_thresh, mode, materials"),
    "no YAML": ("image: [\n", ": cannot be read as YAML: while parsing a flow node did not find "
                              "expected node content in \"<unicode string>\", line 2, column 1"),
    "without an origin": ("image: room.pgm\nresolution: 0.5\nnegate: 0\n",
                          ": 'origin' is missing"),
}


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def complaint_about(*arguments):
    """The text of ``desim run`` on standard error before it gives up over wrong input."""
    done = CliRunner().invoke(app, ["run", "case.yaml", "--quiet", "--set", "stop.elapsed=1 s",
                                    *arguments])
    assert (done.exit_code, done.stdout) == (2, "")
    assert "Traceback" not in done.stderr
    return done.stderr


def nothing_left(folder):
    """No file, and no folder that looks like a run's, beside Python's bytecode."""
    return not [path for path in folder.rglob("*") if "__pycache__" not in path.parts
                and (path.is_file() or path.suffix)]


@pytest.mark.parametrize("case", WORLDS)
def test_wrong_world(here, case):
    text, complaint = WORLDS[case]
    (here / "case.yaml").write_text(f"name: x\n{text}\n")
    assert complaint_about() == f"case.yaml:{complaint}\n"
    assert nothing_left(here / "results")


def with_map(here, text):
    (here / "map.yaml").write_text(text)
    (here / "case.yaml").write_text("name: x\nenvironment: {terrain: map.yaml}\n"
                                    "fleet: {start: {from: [0 m, 0 m]}}\n")
    room = np.full((20, 20), 254, np.uint8)
    room[[0, -1]] = room[:, [0, -1]] = 0
    Image.fromarray(room).save("room.pgm")
    Image.fromarray(np.full((4, 4), 205, np.uint8)).save("grey.pgm")
    (here / "notes.pgm").write_text("Dear diary\n")
    (here / "empty.pgm").touch()


def on_the_map(here, complaint):
    file = "/map.yaml" if complaint.startswith(":") else "/"
    return f"case.yaml:2:24: environment.terrain: {here}{file}{complaint.format(here=here)}\n"


@pytest.mark.parametrize("case", MAPS)
def test_wrong_map(here, case):
    wrong, complaint = MAPS[case]
    key, _, value = wrong.partition(": ")
    with_map(here, "".join(f"{k}: {v}\n" for k, v in {**GOOD_MAP, key: value}.items()))
    assert complaint_about() == on_the_map(here, complaint)
    assert nothing_left(here / "results")


@pytest.mark.parametrize("case", WHOLE_MAPS)
def test_no_map(here, case):
    text, complaint = WHOLE_MAPS[case]
    with_map(here, text)
    assert complaint_about() == on_the_map(here, complaint)
    assert nothing_left(here / "results")


def test_the_good_map_is_none_of_them(here):
    with_map(here, "".join(f"{k}: {v}\n" for k, v in GOOD_MAP.items()))
    done = CliRunner().invoke(app, ["run", "case.yaml", "--quiet", "--until", "1 s"])
    assert (done.exit_code, done.stdout, done.stderr) == (0, "", "")


def test_what_an_override_spoils_is_said_of_the_override(here):
    (here / "case.yaml").write_text("name: x\n")
    assert complaint_about("--set", "fleet.start.from=[-41 m, 0 m]") == (
        "--set fleet.start.from=[-41 m, 0 m]: fleet.start: the start of robot_0 at (-41, 0) m lies "
        f"outside the terrain; {AREA}\n")


def test_a_strategy_that_cannot_be_made_is_said_at_its_place(here, monkeypatch):
    """Strategies are made when their robots start, which is after the run's folder was begun."""
    monkeypatch.setattr(sys, "path", list(sys.path))
    (here / "picky.py").write_text(
        "from desim import errors, ports\n"
        "class Picky:\n"
        "    Params = ports.Params\n"
        "    def __init__(self, params): raise errors.InputError('.strategy: wants another body')\n"
        "    def choose(self, view): return None\n")
    (here / "case.yaml").write_text("name: x\ncoordination:\n  strategy: picky:Picky\n")
    assert complaint_about() == "case.yaml:3:13: coordination.strategy: wants another body\n"
    (here / "picky.py").unlink()
    (here / "case.yaml").unlink()
    assert nothing_left(here)


def test_nothing_is_left_of_a_wrong_scenario_beside_a_good_run(here):
    (here / "case.yaml").write_text("name: x\n")
    good = api.run("case.yaml", overrides=["stop.elapsed=1 s"])
    complaint_about("--set", "fleet.size=41")
    assert [path.name for path in (here / "results" / "x").iterdir()] == [good.path.name]


# ------------------------------------------------------------------------------ runs that are cut


def started(*arguments):
    """``desim run`` on a terminal, and that terminal, once the clock has moved."""
    terminal, inside = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-c", "from desim.cli import app; app()", "run", str(MAZE_30),
         "--set", "stop.explored=100 %", *arguments],
        stdout=inside, stderr=subprocess.PIPE, env={**os.environ, "TERM": "xterm"})
    os.close(inside)
    said = b""
    while not re.search(rb"simulated\s+[1-9][0-9.]* s", said):
        said += os.read(terminal, 4096)
    return process, terminal


def ended(process, terminal):
    """Its exit code and what it wrote to standard error."""
    while True:
        try:
            if not os.read(terminal, 4096):
                break
        except OSError:  # Linux says so of a terminal that nobody has open any more
            break
    complaint = process.communicate()[1].decode()
    os.close(terminal)
    return process.returncode, complaint


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_leaves_what_there_is_and_says_so(here, how):
    process, terminal = started()
    process.send_signal(how)
    code, complaint = ended(process, terminal)
    (folder,) = (here / "results" / "maze_30").iterdir()
    assert code == 130
    assert complaint == f"interrupted; what there is until then: {folder.relative_to(here)}\n"
    run = Run(folder)
    assert run.manifest["status"] == run.metrics["stop_reason"] == "interrupted"
    assert run.metrics["exploration_time_s"] is None and run.metrics["censored"]
    assert run.manifest["simulated_s"] == run.metrics["simulated_s"] > 0.5
    assert run.samples["time_s"][-1] == run.metrics["simulated_s"]
    assert json.loads((folder / "manifest.json").read_text())["digest"] == run.metrics["digest"]


def test_a_killed_run_is_no_run(here):
    process, terminal = started()
    process.kill()
    code, _ = ended(process, terminal)
    (folder,) = (here / "results" / "maze_30").iterdir()
    assert code == -signal.SIGKILL
    assert folder.suffix == ".partial" and not (folder / "manifest.json").exists()
    with pytest.raises(InputError, match="it is being written, or was cut off"):
        Run(folder)
    done = CliRunner().invoke(app, ["figure", str(folder)])
    assert done.exit_code == 2 and "not the folder of a run" in done.stderr
