"""Files that are none, far too large, or full of mistakes; and those for another command."""

import os

import pytest
from typer.testing import CliRunner

from desim.cli import app


@pytest.fixture
def said(tmp_path, monkeypatch):
    """Exit code and lines of a command in ``tmp_path``."""
    monkeypatch.chdir(tmp_path)

    def ask(*words):
        result = CliRunner().invoke(app, words)
        assert result.exception is None or isinstance(result.exception, SystemExit), words
        return result.exit_code, result.output.splitlines()

    return ask


@pytest.mark.parametrize("command", ["run", "sweep"])
def test_what_is_no_regular_file(said, tmp_path, command):
    os.mkfifo(tmp_path / "pipe.yaml")
    (tmp_path / "zero.yaml").symlink_to("/dev/zero")
    (tmp_path / "folder.yaml").mkdir()
    for name, text in (("pipe", "is no regular file"), ("zero", "is no regular file"),
                       ("folder", "Is a directory")):
        assert said(command, f"{name}.yaml") == (2, [f"{name}.yaml: cannot be read: {text}"])


def test_ten_megabytes_are_enough(said, tmp_path):
    (tmp_path / "large.yaml").write_bytes(b"name: a\n#" + bytes(10_000_000))
    assert said("run", "large.yaml") == (
        2, ["large.yaml: cannot be read: has 10.0 MB; at most 10 MB"])


@pytest.mark.parametrize("count, last", [
    (20, "f.yaml:22:3: fleet.k19: unknown key; allowed: size, robots, types, start"),
    (21, "and 1 more thing that is wrong"), (3000, "and 2980 more things that are wrong")])
def test_of_many_complaints_the_first_ones_and_a_count(said, tmp_path, count, last):
    (tmp_path / "f.yaml").write_text(
        "name: a\nfleet:\n" + "".join(f"  k{i}: 1\n" for i in range(count)))
    code, lines = said("run", "f.yaml")
    assert code == 2 and len(lines) == min(count, 21) and lines[-1] == last
    assert lines[0] == "f.yaml:3:3: fleet.k0: unknown key; allowed: size, robots, types, start"


def test_a_scenario_and_a_design_name_each_others_command(said, tmp_path):
    (tmp_path / "s.yaml").write_text("name: s\nfleet: {size: 2}\n")
    (tmp_path / "d.yaml").write_text("name: d\nbase: s.yaml\niterations: 2\n")
    assert said("run", "d.yaml") == (
        2, ["d.yaml:2:7: base: this is a design, of many runs: desim sweep d.yaml"])
    assert said("sweep", "s.yaml") == (
        2, ["s.yaml: this is a scenario, of one run: desim run s.yaml; a design has a base and "
            "parameters; desim sweep s.yaml --vary fleet.size=4,8 needs none"])


def test_a_path_that_cannot_be_one(said, tmp_path):
    (tmp_path / "f.yaml").write_text('extends: "a\\0b"\nname: f\n')
    assert said("run", "f.yaml") == (
        2, ["f.yaml:1:10: extends: must be the path of a file, got 'a\\x00b'"])


def test_a_key_gives_a_terminal_no_commands(said, tmp_path):
    (tmp_path / "f.yaml").write_text('name: f\n"\\e[31mred": 1\n')
    code, lines = said("run", "f.yaml")
    assert code == 2 and "\x1b" not in lines[0] and r"\x1b[31mred: unknown key" in lines[0]


LOUD = """
from desim import ports


class Loud:
    class Params(ports.Params):
        pass

    def __init__(self, params):
        pass

    def choose(self, view):
        raise ValueError("\\x1b[31mred")
"""


def test_nor_do_labels_and_errors_of_plug_ins(said, tmp_path):
    """Commands of the terminal: ESC and CSI, which may also move its title or its cursor."""
    (tmp_path / "loud.py").write_text(LOUD)
    (tmp_path / "s.yaml").write_text("name: s\nstop: {elapsed: 1 s}\n"
                                     "coordination: {strategy: 'loud:Loud'}\n")
    (tmp_path / "d.yaml").write_text(
        'name: d\nbase: s.yaml\niterations: 1\n'
        'parameters: {fleet: {levels: {"\\e[31mred": {fleet.size: 1}, "\\e]0;t\\a": '
        '{fleet.size: 2}}}}\n')
    printed = []
    for code, words in ((1, ("run", "s.yaml")), (1, ("sweep", "d.yaml", "--dry-run")),
                        (1, ("sweep", "d.yaml", "--jobs", "1")), (0, ("report", "results/d"))):
        done, lines = said(*words)
        assert done == code and not any("\x1b" in line or "\x9b" in line or "\a" in line
                                        for line in lines), lines
        printed.append(lines)
    assert any(r"fleet=\x1b[31mred" in line for line in printed[1])


def test_a_stop_condition_that_leaves(said, tmp_path):
    (tmp_path / "f.yaml").write_text("name: f\nstop: {when: 'sys:exit', elapsed: 10 s}\n")
    code, lines = said("run", "f.yaml", "--quiet")
    assert code == 1 and not any("{'" in line for line in lines)
    assert any("sys.exit() was called" in line for line in lines)


@pytest.mark.parametrize("text", ["environment: {terrain: m.yaml}",
                                  "fleet: {start: {file: m.yaml}}"])
def test_what_a_scenario_names_is_a_regular_file_too(said, tmp_path, text):
    os.mkfifo(tmp_path / "m.yaml")
    (tmp_path / "f.yaml").write_text(f"name: f\n{text}\n")
    code, lines = said("run", "f.yaml")
    assert code == 2 and len(lines) == 1, lines


def test_a_plug_ins_file_has_at_most_100_megabytes(said, tmp_path):
    with open(tmp_path / "links.csv", "wb") as file:
        file.truncate(100_000_001)
    (tmp_path / "f.yaml").write_text(
        "name: f\ndeployment: field\nnetwork:\n  media:\n"
        "    air: {model: replay, file: links.csv}\n")
    assert said("run", "f.yaml") == (2, [
        f"f.yaml:5:32: network.media.air.file: {tmp_path}/links.csv: has 100.0 MB; at most 100 MB"])
