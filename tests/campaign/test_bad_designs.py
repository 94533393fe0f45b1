"""Wrong designs: each gives one line, with its place, before anything runs."""

import sys

import pytest
from designs import BASE
from typer.testing import CliRunner

from desim.campaign.design import load_design
from desim.campaign.metrics import Metrics
from desim.campaign.plan import Plan
from desim.cli import app
from desim.errors import InputError

P = "parameters: {robots: {key: fleet.size, values: [1, 2]}}\n"
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
"""

# What follows "name: d" and "base: small.yaml", and the complaint without "d.yaml:" in front; "..."
# stands for more of what is allowed.
WRONG = {
    "unknown key": ("paramters: {}",
        "3:1: paramters: unknown key (did you mean 'parameters'?); allowed: name, question, "
        "base, set, parameters, vectors, iterations, seed, random_numbers, stop, measure, "
        "metrics, report"),
    "unknown key of a parameter": ("parameters: {robots: {key: fleet.size, "
        "vals: [1]}}",
        "3:40: parameters.robots.vals: unknown key (did you mean 'values'?); allowed: key, "
        "values"),
    "no shape": ("parameters: {robots: 5}",
        "3:22: parameters.robots: must be a mapping with key, values, or a mapping with "
        "levels, or a mapping with key, from, to, step, count, scale, got 5"),
    "unknown path": ("parameters: {robots: {key: fleet.siz, values: [1, 2]}}",
        "3:48: fleet.siz: unknown key (did you mean 'size'?); allowed: size, robots, types, "
        "start"),
    "unknown family": ("parameters: {robots: {key: flet.size, values: [1, 2]}}",
        "3:48: flet: unknown key (did you mean 'fleet'?); allowed: name, seed, deployment, "
        "testbed, physics, environment, fleet, robot, hosts, network, middleware, "
        "coordination, faults, stop, measure, trace"),
    "empty key": ("parameters: {robots: {key: '', values: [1, 2]}}",
        "3:41: parameters.robots.values.0: '' is not a key of the scenario, e.g. fleet.size"),
    "wrong value": ("parameters: {robots: {key: fleet.size, values: [1, two]}}",
        "3:52: fleet.size: must be a whole number, got 'two'"),
    "unit missing": ("parameters: {range: {key: robot.laser.max_range, from: "
        "1, to: 5}}",
        "3:21: robot.laser.max_range: 1 has no unit; allowed: m, km, cm, mm, e.g. '200 m'"),
    "empty range": ("parameters: {robots: {key: fleet.size, from: 5, to: 1}}",
        "3:22: parameters.robots: the range from 5 to 1 is empty"),
    "different units": ("parameters: {robots: {key: robot.laser.max_range, "
        "from: 5 m, to: 100 cm}}",
        "3:22: parameters.robots: '5 m' and '100 cm' have different units; write them in one"),
    "no number": ("parameters: {robots: {key: fleet.size, from: one, to: 5}}",
        "3:22: parameters.robots: 'one' is not a number, e.g. 8 or '10 Mb/s'"),
    "step zero": ("parameters: {robots: {key: fleet.size, from: 1, to: 5, "
        "step: 0}}",
        "3:22: parameters.robots: the step 0 must be above zero"),
    "step text": ("parameters: {robots: {key: fleet.size, from: 1, to: 5, "
        "step: x}}",
        "3:22: parameters.robots: 'x' is not a number, e.g. 8 or '10 Mb/s'"),
    "step and count": ("parameters: {robots: {key: fleet.size, from: 1, to: "
        "5, step: 1, count: 3}}",
        "3:22: parameters.robots: has step and count; one of them is enough"),
    "log from zero": ("parameters: {robots: {key: fleet.size, from: 0, to: "
        "5, count: 3, scale: log}}",
        "3:22: parameters.robots: a logarithmic range begins above zero"),
    "log step": ("parameters: {robots: {key: fleet.size, from: 1, to: 5, "
        "step: 2, scale: log}}",
        "3:22: parameters.robots: a logarithmic range has a count, not a step"),
    "scale": ("parameters: {robots: {key: fleet.size, from: 1, to: 5, scale: "
        "lg, count: 2}}",
        "3:63: parameters.robots.scale: 'lg' is not allowed (did you mean 'log'?); allowed: "
        "linear, log"),
    "too many values": ("parameters: {robots: {key: fleet.size, from: 1, to: "
        "1000000000}}",
        "3:22: parameters.robots: has more than 100,000 values"),
    "count huge": ("parameters: {robots: {key: fleet.size, from: 1, to: 5, "
        "count: 1000000000}}",
        "3:63: parameters.robots.count: must be at most 10000, got 1000000000"),
    "infinite": ("parameters: {robots: {key: fleet.size, from: 1, to: .inf}}",
        "3:53: .inf is not a finite number"),
    "huge exp": ("parameters: {robots: {key: fleet.size, from: 1 m, to: 1e99 "
        "m, step: 1 m}}",
        "3:22: parameters.robots: has more than 100,000 values"),
    "no values": ("parameters: {robots: {key: fleet.size}}",
        "3:22: parameters.robots: has no values; give it values, a step or a count, or let "
        "the vectors name them"),
    "no values in all": ("parameters: {range: {key: robot.laser.max_range, "
        "from: 1 m, to: 5 m}}",
        "3:21: parameters.range: has no values; give it values, a step or a count, or let the "
        "vectors name them"),
    "twice": ("parameters: {robots: {key: fleet.size, values: [1, 2, 1]}}",
        "3:22: parameters.robots: the value 1 stands there twice"),
    "two levels of one name": ("parameters: {how: {levels: {a: {fleet.size: "
        "1}, a: {fleet.size: 2}}}}",
        "3:49: the key 'a' stands here a second time, first in line 3"),
    "levels empty": ("parameters: {how: {levels: {}}}",
        "3:19: parameters.how: has no levels"),
    "level no mapping": ("parameters: {how: {levels: {a: 5}}}",
        "3:32: parameters.how.levels.a: must be a mapping, got 5"),
    "name": ("parameters: {'my robots': {key: fleet.size, values: [1]}}",
        "3:14: parameters.my robots: 'my robots' is not allowed; allowed: text that matches "
        "^[A-Za-z][A-Za-z0-9_]{0,59}$"),
    "sets nothing": ("parameters: {robots: {values: [1, 2]}}",
        "3:22: parameters.robots: sets nothing: give it a key, or use $robots in set or in "
        "levels"),
    "dollar": (P + "set: {robot.laser.beams: $robts}",
        "4:26: set.robot.laser.beams: there is no parameter 'robts' (did you mean 'robots'?); "
        "allowed: $robots"),
    "fixed column": ("parameters: {seed: {key: fleet.size, values: [1]}}",
        "3:20: parameters.seed: seed is a column of every campaign in runs.parquet, too; "
        "choose another name"),
    "metric column": ("parameters: {explored: {key: fleet.size, values: [1]}}",
        "3:24: parameters.explored: explored is a column of a metric in runs.parquet, too; "
        "choose another name"),
    "two columns": ("parameters: {t: {key: stop.elapsed, values: [1 s]}, "
        "t_s: {key: fleet.size, values: [1]}}",
        "3:58: parameters.t_s: t_s is a column of the parameter t in runs.parquet, too; "
        "choose another name"),
    "metric run_id": ("metrics: {seed: explored / 2}",
        "3:17: metrics.seed: is a column that runs.parquet always has; choose another name"),
    "metric like a parameter": (P + "metrics: {robots: explored / 2}",
        "3:22: parameters.robots: robots is a column of a metric in runs.parquet, too; choose "
        "another name"),
    "seed key": ("parameters: {s: {key: seed, values: [1, 2]}}",
        "3:38: parameters.s.values.0: sets the scenario's seed, which is the design's: see "
        "seed, iterations and random_numbers"),
    "name key": ("set: {name: foo}",
        "3:13: set.name: sets the scenario's name, which is the design's: runs of all vectors "
        "lie in one folder"),
    "vectors word": (P + "vectors: al",
        "4:10: vectors: 'al' is not allowed (did you mean 'all'?); allowed: all, zip, a list "
        "of mappings, function, latin_hypercube, sobol, saltelli"),
    "vectors number": (P + "vectors: 5",
        "4:10: vectors: must be text, or a list, or a mapping with function, or a mapping "
        "with latin_hypercube, or a mapping with sobol, or a mapping with saltelli, got 5"),
    "vectors mapping": (P + "vectors: {sobl: 8}",
        "4:11: vectors.sobl: unknown key (did you mean 'sobol'?); allowed: sobol"),
    "zip lengths2": ("parameters: {robots: {key: fleet.size, values: [1, "
        "2]}, b: {key: robot.laser.beams, values: [1]}}\nvectors: zip",
        "4:10: vectors: zip needs as many values of each parameter, but there are 2 of "
        "robots, 1 of b"),
    "vectors empty": (P + "vectors: []",
        "4:10: vectors: there are none"),
    "vector no mapping": (P + "vectors: [5]",
        "4:11: vectors.0: must be a mapping, got 5"),
    "vector unknown": (P + "vectors: [{robts: 1}]",
        "4:10: vectors: vector 0 has an unknown parameter 'robts' (did you mean 'robots'?); "
        "allowed: robots"),
    "vector missing": (P + "vectors: [{}]",
        "4:10: vectors: vector 0 has no robots"),
    "vector level": ("parameters: {how: {levels: {near: {fleet.size: "
        "1}}}}\nvectors: [{how: neer}]",
        "4:10: vectors: vector 0: how: 'neer' is not one of its levels (did you mean "
        "'near'?); allowed: near"),
    "vector unhashable": ("parameters: {how: {levels: {near: {fleet.size: "
        "1}}}}\nvectors: [{how: [near]}]",
        "4:10: vectors: vector 0: how: ['near'] is not one of its levels (did you mean "
        "'near'?); allowed: near"),
    "function none": (P + "vectors: {function: 'no_such:f'}",
        "4:10: vectors: cannot load function 'no_such:f': No module named 'no_such'"),
    "function raises": (P + "vectors: {function: 'bad_functions:raises'}",
        "4:10: vectors: bad_functions:raises raised ValueError: oh no"),
    "function not callable": (P + "vectors: {function: 'bad_functions:THING'}",
        "4:10: vectors: 'bad_functions:THING' is not a function"),
    "function endless": (P + "vectors: {function: 'bad_functions:endless'}",
        "4:10: vectors: bad_functions:endless gives more than 1,000,000"),
    "function odd": (P + "vectors: {function: 'bad_functions:odd'}",
        "4:10: vectors: vector 0: robots: Object of type object is not JSON serializable"),
    "function no colon": (P + "vectors: {function: 'bad_functions'}",
        "4:10: vectors: function: 'bad_functions' is not 'package.module:function'"),
    "sobol 0": (P + "vectors: {sobol: 0}",
        "4:18: vectors.sobol: must be at least 1, got 0"),
    "sobol huge": (P + "vectors: {sobol: 1000000000}",
        "4:18: vectors.sobol: must be at most 1000000, got 1000000000"),
    "saltelli 3": (P + "vectors: {saltelli: 3}",
        "4:10: vectors: saltelli: the number of points must be a power of two, got 3"),
    "samples none": ("vectors: {sobol: 4}",
        "3:10: vectors: there are no parameters to take samples of"),
    "samples no values": ("parameters: {robots: {key: fleet.size}}\nvectors: "
        "{sobol: 4}",
        "3:22: parameters.robots: has no values to take samples of; give it values, or from "
        "and to"),
    "combinations": ("parameters:\n  p0: {key: robot.laser.beams, from: 1, "
        "to: 1000}\n  p1: {key: robot.laser.beams, from: 1, to: 1000}\n  p2: {key: "
        "robot.laser.beams, from: 1, to: 1000}",
        "1:1: vectors: all combinations are 1,000,000,000 (1000 of p0 x 1000 of p1 x 1000 of "
        "p2); at most 1,000,000: leave out values, or take samples (latin_hypercube)"),
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
        "'exploration_time_s'?); allowed: ..."),
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
    "metric nofile": ("metrics: {mine: 'no_such:f'}",
        "3:17: metrics.mine: cannot load function 'no_such:f': No module named 'no_such'"),
    "metric number": ("metrics: {mine: 5}",
        "3:17: metrics.mine: must be text, got 5"),
    "metric name": ("metrics: {'a b': explored}",
        "3:11: metrics.a b: 'a b' is not allowed; allowed: text that matches "
        "^[A-Za-z][A-Za-z0-9_]{0,59}$"),
    "report metric": ("report: {metrics: [explord]}",
        "3:20: report.metrics.0: no run has a number 'explord' (did you mean 'explored'?); "
        "allowed: ..."),
    "report against": (P + "report: {against: robts}",
        "4:19: report.against: there is no parameter 'robts' (did you mean 'robots'?); "
        "allowed: robots"),
    "report metrics empty": (P + "report: {metrics: []}",
        "4:19: report.metrics: must be a list of at least 1, got a list of 0"),
    "stop": ("stop: {elapsed: 5}",
        "3:17: stop.elapsed: 5 has no unit; allowed: s, ms, us, ns, min, h, µs, e.g. '5 s'"),
    "stop unknown": ("stop: {elapse: 5 s}",
        "3:16: stop.elapse: unknown key (did you mean 'elapsed'?); allowed: explored, by, "
        "elapsed, when"),
    "stop when": ("stop: {when: explord > 1}",
        "3:14: stop.when: unknown quantity 'explord' (did you mean 'explored'?); allowed: ..."),
    "stop when raises": ("stop: {when: 'bad_functions:raises_q'}",
        "2:7: base: a run fails at once: ValueError: oh no"),
    "measure": ("measure: {evry: 5 s}",
        "3:17: measure.evry: unknown key (did you mean 'every'?); allowed: every, on"),
    "set": ("set: {robot.laser: 5}",
        "3:20: robot.laser: must be text, or a mapping with beams, field_of_view, max_range, "
        "rate, noise, pose, got 5"),
    "set list": ("set: [1]",
        "3:6: set: must be a mapping, got a list of 1"),
    "set plugin": ("set: {network.media.lan.model: swich}",
        "3:32: network.media.lan.model: unknown network 'swich' (did you mean 'switch'?); "
        "known: ..."),
    "start in wall": ("set: {fleet.start: {from: [-6 m, 6 m], step: [0 m, 0 "
        "m]}}",
        "3:20: fleet.start: the start of robot_0 at (-6, 6) m lies outside the terrain; "
        "allowed: x from -6 to 6 m, y from -6 to 6 m"),
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
    assert done.output == ("cannot write to file/out: Not a directory; what is finished stays, and "
                           "the same command goes on from there\n")
