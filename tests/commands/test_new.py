"""``desim new``: the shipped scenarios, their questions, and what is written of one."""

import json

import pytest
from typer.testing import CliRunner

from desim.cli import app
from desim.scenario.load import load
from desim.scenario.shipped import belongings, folder, question, shipped
from desim.scenario.starter import SCHEMA


@pytest.fixture
def new(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def ask(*words):
        done = CliRunner().invoke(app, ["new", *words])
        return done.exit_code, done.output.splitlines()

    return ask


def test_every_shipped_file_is_listed_with_a_question(new, repository):
    files = {path.relative_to(repository / "scenarios").with_suffix("").as_posix()
             for path in (repository / "scenarios").rglob("*.yaml")}
    assert {one.name for one in shipped()} == files
    code, lines = new()
    assert code == 0
    assert "  hello                   How long do three robots take to explore a small house " \
           "together?" in lines
    unasked = [one.name for one in shipped() if not one.question.endswith("?")
               and not one.name.endswith("_small")]
    assert not unasked


def test_scenarios_are_run_and_designs_are_swept(new):
    commands = {one.name: one.command for one in shipped()}
    assert [commands[name] for name in ("hello", "paper/cluster", "paper/published")
            ] == ["desim run"] * 3
    assert [commands[name] for name in ("paper/findings", "paper/exploration_ideal_small",
                                        "studies/bandwidth_small")] == ["desim sweep"] * 3
    assert commands["layouts/relay"] == "desim net layout"
    assert new("paper/cluster")[1][-1] == "play it: desim run paper/cluster.yaml"


def test_a_question_is_the_first_sentence_of_the_first_comment(tmp_path):
    (tmp_path / "a.yaml").write_text("# Does 99.5 % cost\n# more than 99 %? It does: much.\n#\n"
                                     "name: a\n")
    assert question(tmp_path / "a.yaml") == "Does 99.5 % cost more than 99 %?"
    (tmp_path / "b.yaml").write_text("name: b\n")
    assert question(tmp_path / "b.yaml") == ""


def test_hello_comes_with_the_schema_and_can_be_run(new, tmp_path):
    assert new("hello") == (0, [f"wrote hello.yaml, and beside it {SCHEMA}",
                                "play it: desim run hello.yaml"])
    first, second = (tmp_path / "hello.yaml").read_text().splitlines()[:2]
    assert first == f"# yaml-language-server: $schema={SCHEMA}"
    assert second.endswith("desim run hello.yaml")
    assert "extends" in json.loads((tmp_path / SCHEMA).read_text())["properties"]
    assert load("hello.yaml").scenario == load(folder() / "hello.yaml").scenario


def test_what_a_scenario_needs_comes_with_it(new, tmp_path):
    assert list(map(str, belongings("warehouse_1000"))) == [
        "warehouse_1000.yaml", "warehouse_300.yaml", "field_30.yaml", "maze_30.yaml"]
    assert "studies/lateness.py" in map(str, belongings("studies/lan_saturation_small"))
    assert new("warehouse_1000", "--to", "deep/er")[0] == 0
    assert load(tmp_path / "deep" / "er" / "warehouse_1000.yaml").scenario.fleet.size == 1000


def test_nothing_is_replaced_without_a_word(new, tmp_path):
    (tmp_path / "maze_30.yaml").write_text("mine\n")
    assert new("maze_8") == (2, ["maze_30.yaml: already there, with other content; allowed: "
                                 "another folder (--to FOLDER), or --force to replace it"])
    assert [path.name for path in tmp_path.iterdir()] == ["maze_30.yaml"]
    assert new("maze_8", "--force")[0] == 0
    assert "Table 4" in (tmp_path / "maze_30.yaml").read_text()
    assert new("maze_8")[0] == 0  # the same again


def test_a_schema_of_another_version_is_replaced_but_no_other_file_of_its_name(new, tmp_path):
    assert new("hello")[0] == 0
    text = (tmp_path / SCHEMA).read_text()
    (tmp_path / SCHEMA).write_text(text[:len(text) // 2])
    assert new("hello")[0] == 0
    assert (tmp_path / SCHEMA).read_text() == text
    (tmp_path / SCHEMA).write_text("{}")
    assert new("hello")[0] == 2


def test_a_name_that_is_not_shipped(new):
    assert new("helo") == (2, ["no scenario 'helo' is shipped (did you mean 'hello'?); desim new "
                               f"lists all {len(shipped())}"])
    assert new("bandwidth")[1][0].startswith(
        "no scenario 'bandwidth' is shipped (did you mean 'studies/bandwidth'?)")


def test_a_folder_that_cannot_be_written(new, tmp_path):
    (tmp_path / "file").write_text("")
    code, lines = new("hello", "--to", "file")
    assert (code, lines) == (2, ["file/hello.yaml cannot be written: File exists; another folder: "
                                 "--to FOLDER"])
    (tmp_path / "hello.yaml").mkdir()
    assert new("hello") == (2, ["hello.yaml: already there, with other content; allowed: another "
                                "folder (--to FOLDER), or --force to replace it"])
    assert new("hello", "--force") == (2, ["hello.yaml cannot be written: Is a directory; another "
                                           "folder: --to FOLDER"])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "hello.yaml"]
