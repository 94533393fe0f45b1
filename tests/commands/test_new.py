"""``desim new``: the shipped scenarios, their questions, and what is written of one."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from desim.cli import app
from desim.scenario.load import load
from desim.scenario.shipped import belongings, folder, found, question, shipped
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


@pytest.mark.parametrize("name", ["hello", "hello.yaml", "studies/../hello"])
def test_a_file_of_ones_own_comes_before_a_shipped_one(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    shipped_one = found(Path(name.removesuffix(".yaml")))
    assert shipped_one.resolve() == folder().resolve() / "hello.yaml"
    assert found(Path("nowhere")) == Path("nowhere")
    (tmp_path / "studies").mkdir()
    (tmp_path / "hello.yaml").touch()
    assert found(Path(name)).resolve() == tmp_path / "hello.yaml"


def test_a_shipped_scenario_runs_by_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, ["run", "hello", "--until", "1s", "--quiet"])
    assert done.exit_code == 0, done.output
    assert len(list((tmp_path / "results" / "hello").iterdir())) == 1
    done = CliRunner().invoke(app, ["run", "helo"])
    assert (done.exit_code, done.output) == (2, "helo: no such file\n")


def test_scenarios_are_run_and_designs_are_swept(new):
    commands = {one.name: one.command for one in shipped()}
    assert [commands[name] for name in ("hello", "paper/cluster", "paper/published")
            ] == ["desim run"] * 3
    assert [commands[name] for name in ("paper/findings", "paper/exploration_ideal_small",
                                        "studies/bandwidth_small")] == ["desim sweep"] * 3
    assert commands["layouts/relay"] == "desim net layout"
    assert commands["loop/ros1_chatter"] == "desim loop"
    assert new("paper/cluster")[1][-1] == "play it: desim run paper/cluster.yaml"


def test_real_programs_come_with_their_scenario(new, tmp_path):
    code, lines = new("loop/ros1_chatter")
    assert (code, lines[-1]) == (0, "play it: desim loop loop/ros1_chatter.yaml")
    assert (tmp_path / "loop" / "programs" / "talker.py").is_file()
    assert load(tmp_path / "loop" / "ros1_chatter.yaml").scenario.loop.ros_master == "base"


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


PLAN = """<svg viewBox='0 0 100 60'><rect x='5' y='5' width='90' height='50' fill='none'
stroke='black'/><line x1='50' y1='5' x2='50' y2='40' stroke='black'/></svg>"""


def test_a_scenario_on_a_floor_plan_of_one_s_own(new, tmp_path):
    (tmp_path / "office.svg").write_text(PLAN)
    code, lines = new("--from", "office.svg", "--scale", "0.1", "--robots", "turtlebot3_burger")
    assert (code, lines) == (0, [
        "note: 2 dark lines are walls as thick as they are drawn, 0 dark shapes are solid",
        "wrote office_fleet.yaml", "play it: desim run office_fleet.yaml"])
    text = (tmp_path / "office_fleet.yaml").read_text()
    assert text.startswith("# The terrain is that of office.svg; see docs/maps.md.\n"
                           "name: office_fleet\nenvironment:\n")
    assert "# What to change next: the network" in text
    fleet = load("office_fleet.yaml").scenario.fleet
    assert (fleet.size, fleet.robots) == (2, "turtlebot3_burger")
    assert all(0.5 < pose.x_m < 9.5 and -5.5 < pose.y_m < -0.5 for pose in fleet.start.poses)
    assert new("--from", "office.svg", "--scale", "0.1") == (2, [
        "office_fleet.yaml: already there; allowed: another name (desim new NAME --from FILE), "
        "another folder (--to FOLDER), or --force to replace it"])
    assert new("mine", "--from", "office.svg", "--scale", "0.1", "--to", "a/b")[1][-1] == (
        "play it: desim run a/b/mine.yaml")


def test_what_its_comments_propose_can_be_run(new, tmp_path):
    (tmp_path / "office.svg").write_text(PLAN)
    assert new("--from", "office.svg", "--scale", "0.1")[0] == 0
    lines = (tmp_path / "office_fleet.yaml").read_text().splitlines()
    proposed = [line.removeprefix("# ") for line in lines
                if line.startswith(("# network:", "# coordination:", "# stop:"))]
    (tmp_path / "changed.yaml").write_text("\n".join([*lines, *proposed]))
    assert load("changed.yaml").scenario.coordination.strategy == "minpos"
    assert len(proposed) == 3


def test_a_map_comes_with_a_scenario_on_an_image(new, tmp_path):
    from PIL import Image, ImageDraw

    image = Image.new("L", (100, 60), 255)
    ImageDraw.Draw(image).rectangle((5, 5, 95, 55), outline=0, width=2)
    image.save(tmp_path / "hall.png")
    assert new("--from", "hall.png", "--resolution", "0.1")[1][-2:] == [
        "wrote hall_fleet.yaml, and beside it hall_fleet.map.pgm, hall_fleet.map.yaml",
        "play it: desim run hall_fleet.yaml"]
    assert load("hall_fleet.yaml").scenario.fleet.size == 2


def test_a_scenario_on_a_wrong_file(new, tmp_path):
    (tmp_path / "notes.txt").write_text("Dear diary")
    assert new("--from", "notes.txt")[1][0].startswith("notes.txt: no terrain; allowed: a map of R")
    assert new("--from", "notes.txt", "--robots", "pioner3dx")[1][0].startswith(
        "--robots: unknown type 'pioner3dx' (did you mean 'pioneer3dx'?); allowed: pioneer3dx, ")
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]
