"""Wrong designs: each gives one line, with its place, before anything runs."""

import sys

import pytest
from designs import BASE
from typer.testing import CliRunner
from wrong_parameters import PARAMETERS, P

from desim.campaign.design.design import load_design
from desim.campaign.design.metrics import Metrics
from desim.campaign.design.plan import Plan
from desim.cli import app
from desim.errors import InputError

FUNCTIONS = """\
THING = 5

def raises():
    raise ValueError("oh no")

def number():
    return 5

def endless():
    n = 0
    while True:
        n += 1
        yield {"robots": n}

def odd():
    return [{"robots": object()}]

def raises_run(run):
    raise ValueError("oh no")

def raises_q(quantities):
    raise ValueError("oh no\\nand more")

def words(run):
    return "many"

def nothing():
    return None

def a_mapping():
    return {"robots": [1, 2]}

def quits():
    raise SystemExit("bye")

def quits_run(run):
    raise SystemExit("bye")

def says_much():
    raise ValueError("first\\nsecond")

def says_nothing():
    raise ValueError

def not_a_number():
    return [{"robots": float("nan")}]
"""

# What follows "name: d" and "base: small.yaml", and the complaint without "d.yaml:" in front; "..."
# stands for more of what is allowed.
WRONG = PARAMETERS | {
    "unknown key": ("paramters: {}",
        "3:1: paramters: unknown key (did you mean 'parameters'?); allowed: name, question, "
        "base, set, parameters, vectors, iterations, seed, random_numbers, stop, measure, "
        "limits, metrics, report, reference"),
    "iterations x": ("parameters: {p: {key: robot.laser.beams, from: 1, to: "
        "1000}}\niterations: 100000",
        "4:13: iterations: 1,000 vectors of 100,000 iterations; at most 1,000,000 runs"),
    "iterations neg": ("iterations: -1",
        "3:13: iterations: must be at least 1, got -1"),
    "iterations zero": ("iterations: 0",
        "3:13: iterations: must be at least 1, got 0"),
    "iterations text": ("iterations: many",
        "3:13: iterations: must be a whole number, or a mapping with metric, width, at_least, "
        "at_most, got 'many'"),
    "iterations float": ("iterations: 2.5",
        "3:13: iterations: must be a whole number, or a mapping with metric, width, at_least, "
        "at_most, got 2.5"),
    "until unknown": ("iterations: {metric: exploration_tme, width: 10 %}",
        "3:22: iterations.metric: no run has a number 'exploration_tme' (did you mean "
        "'exploration_time_s'?); allowed: ..."),
    "until word": ("iterations: {metric: stop_reason, width: 10 %}",
        "3:22: iterations.metric: no run has a number 'stop_reason'; allowed: ..."),
    "until width": ("iterations: {metric: explored, width: wide}",
        "3:39: iterations.width: 'wide' is not a width; allowed: a number above zero, in the "
        "metric's unit, or a share of the mean such as '10 %'"),
    "until width unit": ("iterations: {metric: explored, width: 5 s}",
        "3:39: iterations.width: '5 s' is not a width; allowed: a number above zero, in the "
        "metric's unit, or a share of the mean such as '10 %'"),
    "until width bool": ("iterations: {metric: explored, width: true}",
        "3:39: iterations.width: True is not a width; allowed: a number above zero, in the "
        "metric's unit, or a share of the mean such as '10 %'"),
    "until bounds": ("iterations: {metric: explored, width: 10 %, at_least: "
        "9, at_most: 5}",
        "3:13: iterations: at_least 9 is above at_most 5"),
    "until 1": ("iterations: {metric: explored, width: 10 %, at_least: 1}",
        "3:55: iterations.at_least: must be at least 2, got 1"),
    "until no width": ("iterations: {metric: explored}",
        "3:1: iterations: the key 'width' is missing: of the interval at most, e.g. '10 %' of "
        "the mean, or 12.5"),
    "seed": ("seed: -1",
        "3:7: seed: must be at least 0, got -1"),
    "random": ("random_numbers: comon",
        "3:17: random_numbers: 'comon' is not allowed (did you mean 'common'?); allowed: "
        "common, independent"),
    "metric unknown": ("metrics: {mine: exploraton / 2}",
        "3:17: metrics.mine: unknown quantity 'exploraton' (did you mean "
        "'exploration_cost'?); allowed: ..."),
    "metric syntax": ("metrics: {mine: explored +}",
        "3:17: metrics.mine: 'explored +' is not an expression; allowed: numbers, names, + - "
        "* /, comparisons, and, or, not, min(), max(), abs() and parentheses"),
    "metric word": ("metrics: {mine: stop_reason / 2}",
        "3:17: metrics.mine: unknown quantity 'stop_reason'; allowed: ..."),
    "metric taken": ("metrics: {explored: explored / 2}",
        "3:21: metrics.explored: is the name of a metric of every run; choose another one"),
    "metric function": ("metrics: {mine: 'bad_functions:raises_run'}",
        "3:17: metrics.mine: bad_functions:raises_run raised ValueError: oh no (tried on a "
        "run of 0.01 s)"),
    "metric no number": ("metrics: {mine: 'bad_functions:words'}",
        "3:17: metrics.mine: bad_functions:words raised ValueError: could not convert string "
        "to float: 'many' (tried on a run of 0.01 s)"),
    "metric quits": ("metrics: {mine: 'bad_functions:quits_run'}",
        "3:17: metrics.mine: bad_functions:quits_run raised SystemExit: bye (tried on a run of "
        "0.01 s)"),
    "metric of a metric": ("metrics: {mine: explored, yours: mine * 2}",
        "3:34: metrics.yours: unknown quantity 'mine'; allowed: ..."),
    "metric power": ("metrics: {mine: explored ** 2}",
        "3:17: metrics.mine: 'explored ** 2' is not allowed in an expression; allowed: numbers, "
        "names, + - * /, comparisons, and, or, not, min(), max(), abs() and parentheses"),
    "metric attribute": ("metrics: {mine: explored.__class__}",
        "3:17: metrics.mine: 'explored.__class__' is not allowed in an expression; allowed: "
        "numbers, names, + - * /, comparisons, and, or, not, min(), max(), abs() and parentheses"),
    "metric nofile": ("metrics: {mine: 'no_such:f'}",
        "3:17: metrics.mine: cannot load function 'no_such:f': No module named 'no_such'; "
        "looked beside the file that names it, where Python finds modules, and in the current "
        "directory"),
    "metric number": ("metrics: {mine: 5}",
        "3:17: metrics.mine: must be text, got 5"),
    "metric name": ("metrics: {'a b': explored}",
        "3:11: metrics.a b: 'a b' is not allowed; allowed: text that matches "
        "^[A-Za-z][A-Za-z0-9_]{0,59}$"),
    "report metric": ("report: {metrics: [explord]}",
        "3:20: report.metrics.0: no run has a number 'explord' (did you mean 'explored'?); "
        "allowed: ..."),
    "report pattern": ("report: {metrics: ['*_qqq']}",
        "3:20: report.metrics.0: no run has a number '*_qqq'; allowed: ..."),
    "report against": (P + "report: {against: robts}",
        "4:19: report.against: there is no parameter 'robts' (did you mean 'robots'?); "
        "allowed: robots"),
    "report metrics empty": (P + "report: {metrics: []}",
        "4:19: report.metrics: must be a list of at least 1, got a list of 0"),
    "reference number": ("reference: 1",
        "3:12: reference: must be a mapping with version, got 1"),
    "reference empty": ("reference: {}",
        "3:1: reference: the key 'version' is missing: of the design; raise it with every change "
        "after which results do not compare with those of before"),
    "reference zero": ("reference: {version: 0}",
        "3:22: reference.version: must be at least 1, got 0"),
    "reference words": ("reference: {version: '1.0'}",
        "3:22: reference.version: must be a whole number, got '1.0'"),
    "reference unknown": ("reference: {verson: 1}",
        "3:13: reference.verson: unknown key (did you mean 'version'?); allowed: version"),
    "reference varies more": ("reference: {version: 1}\n"
        "parameters: {b: {key: robot.laser.beams, values: [10, 20]}}",
        "4:17: parameters.b: sets robot.laser.beams; a parameter of a reference design sets either "
        "the terrain, the network, the robots (fleet) or the strategy"),
    "reference varies two": ("reference: {version: 1}\nparameters: {both: {levels: {a: "
        "{fleet.size: 1, coordination.strategy: random_frontier}}}}",
        "4:20: parameters.both: sets robots and strategy; a parameter of a reference design sets "
        "either the terrain, the network, the robots (fleet) or the strategy"),
    "reference varies hosts": ("reference: {version: 1}\n"
        "parameters: {h: {levels: {a: {hosts.base: {}}}}}",
        "4:17: parameters.h: sets none of these; a parameter of a reference design sets either the "
        "terrain, the network, the robots (fleet) or the strategy"),
    "reference of a patrol": ("reference: {version: 1}\nset: {task: patrolling}",
        "3:12: reference: the leaderboard ranks explorations, not patrolling"),
    "stop": ("stop: {elapsed: 5}",
        "3:17: stop.elapsed: 5 has no unit; allowed: s, ms, us, ns, min, h, µs, e.g. '5 s'"),
    "stop unknown": ("stop: {elapse: 5 s}",
        "3:16: stop.elapse: unknown key (did you mean 'elapsed'?); allowed: explored, by, "
        "elapsed, when"),
    "stop when": ("stop: {when: explord > 1}",
        "3:14: stop.when: unknown quantity 'explord' (did you mean 'explored'?); allowed: ..."),
    "stop when raises": ("stop: {when: 'bad_functions:raises_q'}",
        "2:7: base: a run fails at once: stop.when: bad_functions:raises_q raised ValueError: oh "
        "no at bad_functions.py:22 (0 s)"),
    "measure": ("measure: {evry: 5 s}",
        "3:17: measure.evry: unknown key (did you mean 'every'?); allowed: every, periods, on, "
        "when, cost, safety_scale"),
    "set": ("set: {robot.laser: 5}",
        "3:20: robot.laser: must be text, or a mapping with beams, field_of_view, max_range, "
        "height, rate, noise, pose, x, y, yaw, got 5"),
    "set list": ("set: [1]",
        "3:6: set: must be a mapping, got a list of 1"),
    "set plugin": ("set: {network.media.lan.model: swich}",
        "3:32: network.media.lan.model: unknown network 'swich' (did you mean 'switch'?); "
        "known: ..."),
    "start in wall": ("set: {fleet.start: {from: [-6 m, 6 m], step: [0 m, 0 "
        "m]}}",
        "3:20: fleet.start: the start of robot_0 at (-6, 6) m lies outside the terrain; "
        "allowed: x between -6 and 6 m, y between -6 and 6 m, the edges themselves left out"),
}

WHOLE = {
    "no base": ("name: d\n", "d.yaml:1:1: the key 'base' is missing: a scenario's YAML file, "
                             "relative to this one"),
    "base is no path": ("name: d\nbase: 5\n", "d.yaml:2:7: base: must be text, got 5"),
    "base is not there": ("name: d\nbase: other.yaml\n",
                          "d.yaml:2:7: base: no such file: other.yaml"),
    "base is wrong": ("name: d\nbase: wrong.yaml\n",
                      "wrong.yaml:5:9: fleet.siz: unknown key (did you mean 'size'?); allowed: "
                      "size, robots, types, start"),
    "empty": ("", "d.yaml: is empty; a scenario is a mapping, e.g. 'name: hello'"),
    "not YAML": ("name: [d\n", "d.yaml:2:1: not YAML: expected ',' or ']', but got '<stream end>'"),
    "extends itself": ("name: d\nextends: d.yaml\n",
                       "d.yaml:2:10: extends: a circle: d.yaml -> d.yaml"),
    "extends nothing": ("name: d\nextends: gone.yaml\n",
                        "d.yaml:2:10: extends: no such file: gone.yaml"),
    "a list": ("- a\n", "d.yaml:1:1: is a list; a scenario is a mapping, e.g. 'name: hello'"),
    "a tab": ("name: d\nset:\n\ta: 1\n",
              "d.yaml:3:1: not YAML: a tab; indent with spaces"),
    "a name that is a path": ("name: 'a/b'\nbase: small.yaml\n",
                              "d.yaml:1:7: name: 'a/b' is not allowed; allowed: text that matches "
                              "^[A-Za-z0-9][A-Za-z0-9_.-]{0,99}$"),
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.yaml").write_text(BASE)
    (tmp_path / "wrong.yaml").write_text(BASE.replace("size: 2", "siz: 2"))
    (tmp_path / "bad_functions.py").write_text(FUNCTIONS)
    (tmp_path / "bad_module.py").write_text('raise RuntimeError("first\\nsecond")\n')
    yield tmp_path
    sys.modules.pop("bad_functions", None)


def complaints(folder, text):
    (folder / "d.yaml").write_text(text)
    with pytest.raises(InputError) as caught:
        Metrics(Plan(load_design("d.yaml")))
    return [str(line) for line in caught.value.args]


@pytest.mark.parametrize("text, expected", WRONG.values(), ids=WRONG)
def test_wrong(folder, text, expected):
    (line,) = complaints(folder, f"name: d\nbase: small.yaml\n{text}\n")
    start, dots, _ = expected.partition("...")
    assert line.removeprefix("d.yaml:")[:len(start) if dots else None] == start


@pytest.mark.parametrize("text, expected", WHOLE.values(), ids=WHOLE)
def test_wrong_as_a_whole(folder, text, expected):
    assert complaints(folder, text) == [expected]


def test_several_at_once(folder):
    assert complaints(folder, "name: d\nbase: small.yaml\nseed: x\nvectors: 5\n")[0] == (
        "d.yaml:3:7: seed: must be a whole number, got 'x'")


def test_the_command_says_so_and_nothing_else(folder):
    (folder / "d.yaml").write_text(f"name: d\nbase: small.yaml\n{P}metrics: {{m: explord}}\n")
    done = CliRunner().invoke(app, ["sweep", "d.yaml"])
    assert done.exit_code == 2 and "Traceback" not in done.output
    assert done.output.startswith("d.yaml:4:14: metrics.m: unknown quantity 'explord' (did you "
                                  "mean 'explored'?); allowed: ")
    assert not (folder / "results").exists()


@pytest.mark.parametrize("only, expected", [
    ("robots", "--only robots: must be PARAMETER=LEVEL; parameters: robots\n"),
    ("robts=1", "--only robts=1: must be PARAMETER=LEVEL; parameters: robots\n"),
    ("robots=3", "--only robots=3: robots has no level '3'; allowed: 1, 2\n"),
    ("", "--only : must be PARAMETER=LEVEL; parameters: robots\n"),
])
def test_only(folder, only, expected):
    (folder / "d.yaml").write_text(f"name: d\nbase: small.yaml\n{P}")
    done = CliRunner().invoke(app, ["sweep", "d.yaml", "--only", only])
    assert (done.exit_code, done.output) == (2, expected)


def test_a_folder_that_cannot_be_written(folder):
    (folder / "d.yaml").write_text(f"name: d\nbase: small.yaml\n{P}")
    (folder / "file").write_text("")
    done = CliRunner().invoke(app, ["sweep", "d.yaml", "--out", "file/out"])
    assert done.exit_code == 2
    assert done.output == ("file/out: cannot be a campaign's folder: Not a directory; choose "
                           "another one with --out\n")


def test_levels_that_never_come_together(folder):
    (folder / "d.yaml").write_text("name: d\nbase: small.yaml\nvectors: zip\nparameters: {robots: "
                                   "{key: fleet.size, values: [1, 2]}, "
                                   "beams: {key: robot.laser.beams, values: [10, 20]}}\n")
    done = CliRunner().invoke(app, ["sweep", "d.yaml", "--only", "robots=1", "--only", "beams=20"])
    assert (done.exit_code, done.output) == (
        2, "--only robots=1 --only beams=20: no vector has these levels together\n")
    assert not (folder / "results").exists()


@pytest.mark.parametrize("jobs, expected", [
    ("0", "Invalid value for '--jobs': Input should be greater than or equal to 1; allowed: see "
          "desim sweep --help\n"),
    ("two", "Invalid value for '--jobs': Input should be a valid integer, unable to parse string "
            "as an integer; allowed: see desim sweep --help\n")])
def test_jobs(folder, jobs, expected):
    done = CliRunner().invoke(app, ["sweep", "wrong.yaml", "--jobs", jobs])
    assert done.exit_code == 2 and done.output.endswith(expected)
