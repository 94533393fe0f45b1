"""Scenarios with real programs: wrong ones, and commands that cannot run them."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

import desim
from desim.cli import app
from desim.errors import InputError
from desim.scenario.load import load

HEAD = """\
name: x
deployment: field
fleet: {size: 2}
hosts: {base: {}, office: {strategy: centralized}}
"""
# What follows the head, and the complaints without "case.yaml:" in front.
WRONG = {
    "an unknown host": ("loop: {programs: [{host: bse, run: x}]}", [
        "5:26: loop.programs.0.host: unknown host 'bse' (did you mean 'base'?); allowed: robot_0, "
        "robot_1, base, office"]),
    "a host with a strategy": ("loop: {programs: [{host: office, run: x}]}", [
        "5:26: loop.programs.0.host: office runs a strategy of desim; allowed: a host without "
        "software"]),
    "a master without programs": (
        "loop: {ros_master: robot_0, programs: [{host: base, run: x}]}", [
            "5:20: loop.ros_master: unknown host with programs 'robot_0'; allowed: base"]),
    "a master of nobody": ("loop: {ros_master: base}", [
        "5:20: loop.ros_master: base runs no ROS master, as loop.programs is empty; allowed: a "
        "host of one of them"]),
    "no folder": ("loop: {programs: [{host: base, run: x, folder: nowhere/at all}]}", [
        "5:48: loop.programs.0.folder: no folder {here}/nowhere/at all"]),
    "a file for a folder": ("loop: {programs: [{host: base, run: x, folder: case.yaml}]}", [
        "5:48: loop.programs.0.folder: no folder {here}/case.yaml"]),
    "no command": ("loop: {programs: [{host: base, run: ''}]}", [
        "5:37: loop.programs.0.run: no command; allowed: what /bin/sh runs"]),
    "a variable without a name": (
        "loop: {programs: [{host: base, run: x, env: {2A: y, B-C: z, _OK: w}}]}", [
            f"5:{column}: loop.programs.0.env.{name}: '{name}' is no name of an environment "
            "variable; allowed: letters, digits and _, no digit first"
            for name, column in (("2A", 50), ("B-C", 58))]),
    "a key of nothing": ("loop: {programs: [{host: base, run: x, wait: 1 s}]}", [
        "5:40: loop.programs.0.wait: unknown key (did you mean 'at'?); allowed: host, "
        "run, at, env, folder"]),
    "a domain without ports": ("loop: {dds_domain: 233, programs: [{host: base, run: x}]}", [
        "5:20: loop.dds_domain: must be at most 232, got 233"]),
    "goals that nobody can send": (
        "loop: {navigation: true, programs: [{host: robot_0, run: x}]}", [
            "5:20: loop.navigation: robots have no topics on which programs send goals; allowed: "
            "false, or with ros_master or dds_domain"]),
}
RIGHT = "loop: {programs: [{host: base, run: x, folder: in}, {host: robot_1, run: y}]}"


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in").mkdir()

    def write(text):
        (tmp_path / "case.yaml").write_text(text)
    return write


def complaints():
    with pytest.raises(InputError) as raised:
        load("case.yaml")
    return list(raised.value.args)


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_scenario_says_where_and_what_is_allowed(here, case, tmp_path):
    text, expected = WRONG[case]
    here(f"{HEAD}{text}\n")
    assert complaints() == [f"case.yaml:{line}".replace("{here}", str(tmp_path))
                            for line in expected]


def test_a_right_one_has_none(here):
    here(f"{HEAD}{RIGHT}\n")
    assert load("case.yaml").scenario.loop.hosts == {"base", "robot_1"}


@pytest.mark.parametrize(("navigation", "passive"), [("false", ("robot_1",)), ("true", ())])
def test_robots_with_programs_run_software_of_desim_where_it_navigates(here, navigation, passive):
    here(f"{HEAD}loop: {{navigation: {navigation}, dds_domain: 0, "
         "programs: [{host: base, run: x}, {host: robot_1, run: y}]}\n")
    assert load("case.yaml").scenario.robot.passive == passive


def test_robots_of_a_testbed_run_no_programs(here):
    here("name: x\nfleet: {size: 1}\nloop: {programs: [{host: robot_0, run: x}]}\n")
    assert complaints() == [
        "case.yaml:3:26: loop.programs.0.host: in a testbed the computer of robot_0 has no sensors "
        "and motors; allowed: one of hosts, or a robot with deployment: field"]


REFUSED = "case.yaml:5:18: loop.programs: hosts run real programs; allowed: desim loop case.yaml"
DESIGN = "name: d\nbase: case.yaml\nparameters: {n: {key: fleet.size, values: [1, 2]}}\n"


@pytest.mark.parametrize("words", [
    ("run", "case.yaml"), ("run", "case.yaml", "--check"), ("sweep", "design.yaml"),
    ("sweep", "case.yaml", "--vary", "fleet.size=1,2"), ("sweep", "design.yaml", "--dry-run")])
def test_other_commands_refuse_them_with_one_line(here, tmp_path, words):
    here(f"{HEAD}loop: {{programs: [{{host: base, run: x}}]}}\n")
    (tmp_path / "design.yaml").write_text(DESIGN)
    said = CliRunner().invoke(app, words, env={"COLUMNS": "200"})
    assert (said.exit_code, said.stderr.strip()) == (2, REFUSED)
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize("use", [desim.run, desim.Stepper])
def test_so_do_functions(here, use):
    here(f"{HEAD}loop: {{programs: [{{host: base, run: x}}]}}\n")
    with pytest.raises(InputError, match="hosts run real programs; allowed: desim loop case.yaml"):
        use("case.yaml")
    with pytest.raises(InputError, match="hosts run real programs; allowed: desim loop case.yaml"):
        use(desim.load("case.yaml"))
    with pytest.raises(InputError, match="hosts run real programs; allowed: desim loop FILE"):
        use(desim.load("case.yaml").scenario)


@pytest.mark.parametrize(("words", "said"), [
    (("loop", "case.yaml", "--clok", "wall"),
     "No such option: --clok (Possible options: --clock); allowed: see desim loop run --help"),
    (("loop", "build", "--jobs", "0"), "Invalid value for '--jobs': Input should be greater than "
     "or equal to 1; allowed: see desim loop build --help")])
def test_a_wrong_option_names_the_whole_command(words, said):
    done = CliRunner().invoke(app, words)
    assert (done.exit_code, done.stderr.strip()) == (2, said)


def test_what_varies_the_programs_away_can_be_swept(here, tmp_path):
    here(f"{HEAD}loop: {{programs: [{{host: base, run: x}}]}}\n")
    (tmp_path / "design.yaml").write_text(f"{DESIGN}set: {{loop.programs: []}}\n")
    said = CliRunner().invoke(app, ["sweep", "design.yaml", "--dry-run"])
    assert "real programs" not in said.stderr
