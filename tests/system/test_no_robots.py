"""Fleets without robots: hosts and their networks alone, through all commands."""

import json
import re

import pytest
from devtools import Browser, chromium
from typer.testing import CliRunner

from desim.cli import app

SCENARIO = """\
name: hosts
deployment: {deployment}
fleet: {{size: 0}}
hosts: {{base: {{at: [0 m, 0 m]}}, pc: {{at: [5 m, 0 m]}}}}
network:
  media: {{lan: {{model: switch, rate: 10 Mb/s}}}}
  others: {{camera: {{}}, store: {{}}}}
  background:
  - {{medium: lan, between: [camera, store], rate: 2 Mb/s, pattern: periodic}}
  - {{medium: lan, between: [camera, base], rate: 1 Mb/s}}
faults: [{{at: 2 s, host: base, down_for: 2 s}}]
stop: {{elapsed: 6 s}}
"""
DESIGN = """\
name: rates
base: hosts.yaml
parameters: {rate: {key: network.media.lan.rate, values: [10 Mb/s, 20 Mb/s]}}
iterations: 2
"""


def desim(*words):
    result = CliRunner().invoke(app, [*map(str, words)], env={"COLUMNS": "200"})
    assert result.exit_code == 0, (words, result.output, result.exception)
    return result.output


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("hosts")


@pytest.fixture(scope="module", params=["field", "testbed"])
def runs(request, folder):
    """Two runs, seeds 1 and 2, and what the first one said."""
    path = folder / "hosts.yaml"
    path.write_text(SCENARIO.format(deployment=request.param))
    said = [desim("run", path, "--seed", seed, "--out", folder / request.param / str(seed))
            for seed in (1, 2)]
    return *(next((folder / request.param / str(seed)).glob("hosts/*")) for seed in (1, 2)), said[0]


def test_a_run_ends_at_its_time_limit_and_says_what_passed(runs):
    first, _, said = runs
    assert re.sub(r" +", " ", said.partition("speed")[0]).splitlines()[:6] == [
        "hosts, seed 1: finished, elapsed ", "messages 0 sent 0 delivered ",
        " 0 in flight at the end ", "on the air 0.0 kB 0.00 kb/s, all hosts together ",
        next(line for line in re.sub(r" +", " ", said).splitlines() if "busy" in line),
        "background 988 packets camera to store, 988 delivered "]
    summary = json.loads((first / "summary.json").read_text())
    assert (summary["task"], summary["task_metrics"], summary["robots"]) == ("none", [], {})
    assert {summary[name] for name in ("explored", "reachable_area_m2", "map_completeness",
                                       "exploration_cost", "safety")} == {None}
    assert summary["background"][1]["dropped"] == {"host_down": 155}  # 2 s of it


@pytest.mark.parametrize(("words", "says"), [
    (("check",), "as desim wrote them"),
    (("figure",), "figure.png"), (("view",), "replay.html"),
    (("export", "--mcap", "a.mcap"), "a.mcap"), (("export", "--bag", "a.bag"), "a.bag"),
    (("export", "--csv", "tables"), "samples.csv"), (("export", "--graphml", "a.xml"), "hosts"),
    (("export", "--animation", "a.gif"), "a.gif"), (("export", "--pcap", "a.pcap"), "packets"),
])
def test_every_command_takes_such_a_run(runs, tmp_path, words, says):
    name, *options = words
    assert says in desim(name, runs[0], *(
        word if word.startswith("--") else tmp_path / word for word in options))


def test_two_such_runs_are_compared(runs):
    first, second, _ = runs
    assert "neither has robots" in desim("compare", first, second)
    assert "the traces are equal" in desim("diff", first, first)
    assert "replay.html" in desim("view", first, second)


def test_no_message_can_be_late(runs):
    for words, says in ((["why"], "no message between hosts had reached its fate when the run "),
                        (["graph", "--at", "1 s"], "nobody believes anything")):
        result = CliRunner().invoke(app, [*words, str(runs[0])])
        assert result.exit_code == 2 and says in result.stderr


def test_nobody_is_said_to_explore(runs):
    assert "explored" not in runs[2] and "driven" not in runs[2]
    if chromium() is None:
        pytest.skip("there is no Chromium")
    desim("view", runs[0])
    with Browser(runs[0] / "profile") as browser:
        browser.open(runs[0] / "replay.html")
        browser.value("desimReplay.at(desimReplay.span()[1])")
        assert browser.complaints == []
        text = browser.value("document.body.innerText")
    assert not re.search(r"explor|driven|collisions|strategy", text), text


def test_a_campaign_of_hosts_has_a_report(folder, runs):
    (folder / "rates.yaml").write_text(DESIGN)
    campaign = folder / f"campaign of {runs[0].parts[-4]}"
    assert "4 of 4 runs" in desim("sweep", folder / "rates.yaml", "--out", campaign)
    desim("report", campaign)
    page = (campaign / "report" / "report.html").read_text()
    text = re.sub(r"<[^>]+>", " ", page.partition("Metrics by vector")[0])
    assert "messages delivered" in text and "exploration" not in text.lower()
    assert "no key differs" in desim("compare", campaign, campaign)


def test_what_hosts_alone_cannot_do_is_refused(folder, runs):
    path = folder / "task.yaml"
    path.write_text(SCENARIO.format(deployment="field") + "task: {model: patrolling}\n")
    result = CliRunner().invoke(app, ["run", str(path)])
    assert (result.exit_code, result.stderr) == (
        2, f"{path}:13:15: task.model: there is nobody to do it (fleet.size is 0); allowed: none\n")


def test_net_fleet_and_ls(folder, runs):
    assert "nothing is said between hosts" in desim("net", "fleet", folder / "hosts.yaml")
    assert "hosts" in desim("ls", runs[0].parent.parent)
