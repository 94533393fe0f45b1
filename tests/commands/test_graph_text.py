"""``desim graph``: what is printed and drawn, and what it refuses."""

from __future__ import annotations

import json
from io import StringIO
from shutil import copytree

import pytest
from believers import TOPICS, Two, among, of
from rich.console import Console
from toy_middlewares import Late, Naive
from typer.testing import CliRunner

from desim import api
from desim.cli import app
from desim.commands.views import beliefs as report
from desim.results.beliefs import BeliefSnapshot
from desim.results.beliefs import PairBelief as Pair
from desim.results.seal import manifest_of, seal


def shown(known) -> list[str]:
    console = Console(width=200, record=True, file=StringIO())
    report.show(known, console)
    return [line.rstrip() for line in console.export_text().splitlines()]


def test_what_is_printed():
    assert shown(Two(Naive()).at(10.0)) == [
        "at 10 s: 2 of 2 matches known, 0 missing, 2 ghosts, divergence 0.500",
        "4 pairs of hosts: 4 seen online",
        "in truth: who could reach whom was not kept",
        "                   robot  robot  robot",
        "believes           0      1      2",
        "robot_0                   + 2/2  + !2",
        "robot_1            +             +",
        "robot_2 (stopped)",
        "+ seen online, - offline, x removed, . never seen; known/true matches of the publisher "
        "with the other host; !n ghosts",
        "",
        "ghosts:",
        "  robot_0 believes that robot_2 listens to /news (stopped)",
        "  robot_0 believes that robot_2 listens to /report/robot_0 (stopped)"]
    lines = shown(Two(Naive()).at(0.5))
    assert "robot_0          . 0/2  . 0/2" in lines
    assert "  robot_0 does not know that robot_1, robot_2 listen to /news" in lines


def test_a_partitioned_fleet_whose_matches_are_all_known():
    """Each half knows the other's matches: nothing is missing, and yet not all is well."""
    two, apart = Two(Naive()), among("robot_0", "robot_2")
    known = two.at(3.0, linked=apart)
    assert of(known, "robot_0", "robot_1") == Pair("robot_0", "robot_1", "online", TOPICS, (), (),
                                              reached=False)
    assert known.parts == [["robot_0", "robot_2"], ["robot_1"]]
    assert known.seen == {"online": 6, "offline": 0, "removed": 0, "never": 0}
    lines = shown(known)
    assert lines[:3] == [
        "at 3 s: 4 of 4 matches known, 0 missing, 0 ghosts, divergence 0.000",
        "6 pairs of hosts: 6 seen online; in truth 2 in reach, 4 mistaken",
        "in truth apart: robot_0, robot_2 | robot_1"]
    assert "  robot_0, robot_2 take robot_1 for online, which is out of reach" in lines
    answer = report.json_object(known)
    assert (answer["mistaken"], answer["parts"]) == (4, known.parts)
    # One way is not enough.
    assert two.at(3.0, linked=apart | {("robot_0", "robot_1"): True}).parts == known.parts


def test_what_is_alike_stands_together():
    """Two halves of four that have parted: two lines and not 32."""
    hosts = [f"robot_{i}" for i in range(8)]
    views = [Pair(one, other, "online", (), (), (f"/{other}/map",) if i // 4 != k // 4 else (),
                  reached=i // 4 == k // 4)
             for i, one in enumerate(hosts) for k, other in enumerate(hosts) if i != k]
    lines = shown(BeliefSnapshot(0, "publisher", dict.fromkeys(hosts, True), tuple(views)))
    assert [line for line in lines if " take" in line or " believe " in line] == [
        "  robot_0 to robot_3 take robot_4 to robot_7 for online, which are out of reach",
        "  robot_4 to robot_7 take robot_0 to robot_3 for online, which are out of reach",
        "  robot_0 to robot_3 believe that robot_4 to robot_7 listen to /*/map",
        "  robot_4 to robot_7 believe that robot_0 to robot_3 listen to /*/map"]


def test_who_has_stopped_is_out_of_reach():
    everybody = among("robot_0", "robot_1", "robot_2")
    assert shown(Two(Late()).at(10.0, linked=everybody))[1:3] == [
        "4 pairs of hosts: 2 seen online, 2 seen offline; in truth 2 in reach, 0 mistaken",
        "in truth: every host that is up can reach every other one, directly or over others"]
    assert ("  robot_0, robot_1 take robot_2 for online, which has stopped"
            in shown(Two(Naive()).at(10.0, linked=everybody)))


def test_long_parts_are_written_in_short():
    hosts = ["base", *(f"robot_{i}" for i in range(16))]
    assert report._names(hosts[:9], hosts) == "base, robot_0 to robot_7"
    assert report._names([hosts[1], *hosts[3:5], *hosts[8:]], hosts) == (
        "robot_0, robot_2, robot_3, robot_7 to robot_15")


def test_a_narrow_terminal_is_shown_signs_only():
    console = Console(width=30, record=True, file=StringIO(), force_terminal=True)
    report.show(Two(Naive()).at(10.0), console)
    assert "robot_0                 +     +" in [line.rstrip() for line in
                                                 console.export_text().splitlines()]



# ------------------------------------------------------------------------------- the command


@pytest.fixture(scope="module")
def runs(repository, tmp_path_factory):
    """A run that kept its rows, one that did not, and one under direct."""
    folder, hello = tmp_path_factory.mktemp("runs"), repository / "scenarios" / "hello.yaml"
    late = ["middleware.model=toy_middlewares:Late", "stop.elapsed=6 s", "fleet.size=3",
            "faults=[{at: 3 s, host: robot_1}]"]
    return [api.run(hello, out=folder, overrides=overrides).path for overrides in (
        [*late, "trace.keep=all"], late, ["stop.elapsed=1 s"])]


def graph(*words, code=0) -> str:
    done = CliRunner().invoke(app, ["graph", *map(str, words)], catch_exceptions=False)
    assert done.exit_code == code, done.output
    return done.output


@pytest.mark.parametrize("at", ["4s", "4 s", "0 min 4 s", "4000 ms"])
def test_rows_that_were_not_kept_are_made_again(runs, at):
    assert graph(runs[0], "--at", at) == graph(runs[1], "--at", "4s")
    assert graph(runs[0], "--at", at).startswith("at 4 s:")


def test_a_run_keeps_who_can_reach_whom(repository, tmp_path):
    """Also of hosts that are down, and of the base, which is no robot."""
    cut = ("network.media.lan={model: switch, rules: [{rule: partition, groups: [[robot_1, base]], "
           "from: 2 s, until: 4 s}]}")
    path = api.run(repository / "scenarios" / "hello.yaml", out=tmp_path, overrides=[
        "middleware.model=toy_middlewares:Late", "stop.elapsed=5.5 s", "fleet.size=2",
        "hosts.base={}", cut, "faults=[{at: 3.2 s, host: base}]"]).path
    assert "in truth: every host" in graph(path, "--at", "1.9s")
    assert "in truth apart: base, robot_1 | robot_0, workstation" in graph(path, "--at", "2s")
    assert "in truth apart: robot_0, workstation | robot_1" in graph(path, "--at", "3.5s")
    assert "in truth: every host that is up" in graph(path, "--at", "4s")
    # As of the last whole second.
    assert "in truth: every host" in graph(path)


def test_json(runs):
    answer = json.loads(graph(runs[0], "--json", "--at", "4 s"))
    assert answer["at_s"] == 4.0 and answer["informed"] == "publisher"
    assert answer["ghosts"] == sum(len(view["ghosts"]) for view in answer["views"]) > 0
    assert answer["up"]["robot_1"] is False
    assert json.loads(graph(runs[0], "--json"))["at_s"] == 6.0


def test_into_a_file(runs, tmp_path):
    assert graph(runs[0], "--to", tmp_path / "g.svg").endswith("g.svg\n")
    assert (tmp_path / "g.svg").read_text().startswith("<?xml")


@pytest.mark.parametrize(("words", "says"), [
    (["--at", "63"], "--at: '63' has no unit"),
    (["--at", "1 min 3"], "--at: '3' has no unit"),
    (["--at", "63 s"], "--at: 63 s is after the end of the run, which was at 6 s"),
    (["--topic", "/nope"], "--topic: nobody knows"),
    (["--to", "g.txt"], "--to: g.txt does not end like a picture"),
])
def test_bad_input(runs, words, says):
    assert says in graph(runs[0], *words, code=2)


def test_what_is_damaged_is_said_in_one_line(runs, tmp_path):
    for name in "trace.parquet", "links.parquet":
        copy = tmp_path / name
        copytree(runs[0], copy)
        (copy / name).write_bytes((runs[0] / name).read_bytes()[:100])
        assert f"{name}: damaged: " in graph(copy, "--at", "4s", code=2)


@pytest.mark.parametrize("old, new, complaint", [
    ("seed: 1\n", "seed: one\n", ":{line}:7: seed: must be a whole number, got 'one'"),
    ("seed: 1\n", "sed: 1\n", ":{line}:1: sed: unknown key (did you mean 'seed'?)"),
])
def test_a_damaged_scenario_is_said_with_line_and_key(runs, tmp_path, old, new, complaint):
    """By all commands that read it, in the same words."""
    copy = copytree(runs[0], tmp_path / "copy")
    path = copy / "scenario.resolved.yaml"
    text = path.read_text("utf-8")
    line = text[:text.index(old)].count("\n") + 1
    path.write_text(text.replace(old, new, 1), "utf-8")
    seal(copy, manifest_of(copy), set(manifest_of(copy)["files"]))
    expected = f"{path}{complaint.format(line=line)}"
    for words in (["graph", copy], ["view", copy], ["figure", copy],
                  ["why", copy, "--message", "1"]):
        result = CliRunner().invoke(app, [*map(str, words)])
        assert result.exit_code == 2 and expected in result.output, words
        assert "validation error" not in result.output


def test_a_run_without_links_says_so(runs, tmp_path):
    copy = copytree(runs[0], tmp_path / "older")
    manifest = manifest_of(copy)
    seal(copy, {name: value for name, value in manifest.items() if name != "files"},
         set(manifest["files"]) - {"links.parquet"})
    assert "in truth: who could reach whom was not kept" in graph(copy, "--at", "4s")
    assert json.loads(graph(copy, "--at", "4s", "--json"))["parts"] is None
    graph(copy, "--at", "4s", "--to", tmp_path / "g.png")


def test_the_ending_is_looked_at_first(runs, tmp_path):
    """Not after the run was repeated, which may take minutes."""
    (copytree(runs[1], tmp_path / "gone") / "scenario.resolved.yaml").unlink()
    assert "does not end like a picture" in graph(tmp_path / "gone", "--to", "g.txt", code=2)


def test_direct_has_nothing_to_show(runs):
    assert "under middleware 'direct' nobody believes anything" in graph(runs[2], code=2)
    assert "not the folder of a run" in graph(runs[2] / "map", code=2)
