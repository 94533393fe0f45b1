"""``desim ls`` and ``desim compare`` of campaigns: what is listed, damaged folders too."""

from __future__ import annotations

import json
import os

import pytest
from designs import Here, planned
from typer.testing import CliRunner

import desim
from desim.campaign.design.metrics import Metrics
from desim.campaign.folder.results_list import listed
from desim.campaign.running.sweep import Sweep
from desim.cli import app
from desim.errors import InputError


def swept(folder, iterations, out):
    plan = planned(folder, "parameters: {robots: {key: fleet.size, values: [1, 2]}}\n"
                           f"iterations: {iterations}\n")
    with Sweep(plan, Metrics(plan), out) as sweep:
        sweep.run(Here())
    return out


@pytest.fixture(scope="module")
def results(repository, tmp_path_factory):
    """Two runs of hello, one of them older, and two campaigns."""
    folder = tmp_path_factory.mktemp("all")
    out = folder / "results"
    for seed, ended_s in ((1, 1_000_000), (2, 2_000_000)):
        run = desim.run(repository / "scenarios" / "hello.yaml", seed=seed, out=out,
                        overrides=("stop.elapsed=2 s",))
        os.utime(run.path / "manifest.json", (ended_s, ended_s))
    for name, iterations in (("few", 1), ("more", 2)):
        (folder / name).mkdir()
        swept(folder / name, iterations, out / name)
    return out


def by_status(results, status):
    return [entry for entry in listed(results) if entry.status == status]


def test_runs_and_campaigns_newest_first(results):
    found = listed(results)
    assert [entry.status for entry in found] == ["campaign", "campaign", "finished", "finished"]
    assert [entry.seed for entry in found[2:]] == [2, 1]
    run = desim.Run(found[3].path)
    assert found[3].digest == run.manifest["digest"] and found[3].simulated_s == 2.0
    assert found[3].size_bytes == sum(file.stat().st_size for file in run.path.rglob("*")
                                      if file.is_file())
    assert {entry.note for entry in found[:2]} == {"2 runs", "4 runs"}


def test_a_campaigns_own_folder_lists_its_runs(results):
    assert [entry.status for entry in listed(results / "more")] == ["finished"] * 4


def test_the_command(results):
    lines = CliRunner().invoke(app, ["ls", str(results)]).output.splitlines()
    assert lines[0].split()[:6] == ["name", "id", "seed", "status", "when", "simulated"]
    assert len(lines) == 5 and lines[4].split()[0] == "hello"
    found = json.loads(CliRunner().invoke(app, ["ls", str(results), "--json"]).output)
    assert [entry["seed"] for entry in found] == [None, None, 2, 1]


@pytest.mark.parametrize("damage, note", [
    (lambda run: (run / "summary.json").unlink(), "summary.json is missing"),
    (lambda run: (run / "robots.parquet").write_bytes(b"?"),
     "robots.parquet is not what desim wrote"),
    (lambda run: (run / "manifest.json").write_text("{}"),
     "manifest.json is not what desim writes"),
    (lambda run: (run / "manifest.json").unlink(), "not the folder of a run"),
])
def test_damaged_runs_are_named(repository, tmp_path, damage, note):
    run = desim.run(repository / "scenarios" / "hello.yaml", out=tmp_path,
                    overrides=("stop.elapsed=1 s",))
    damage(run.path)
    entry, = listed(tmp_path)
    assert entry.status == "damaged" and entry.run_id == run.path.name
    assert entry.note.startswith(note), entry.note
    assert CliRunner().invoke(app, ["ls", str(tmp_path)]).exit_code == 0


def test_what_is_being_written_and_a_campaign_that_cannot_be_read(tmp_path):
    (tmp_path / "hello" / "0123456789ab.partial").mkdir(parents=True)
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "design.yaml").write_text("name: [")
    partial, = by_status(tmp_path, "partial")
    assert partial.run_id == "0123456789ab" and partial.note == "being written, or cut off"
    broken, = by_status(tmp_path, "damaged")
    assert broken.note.startswith("design.yaml:1:")


def test_a_link_to_a_folder_is_not_followed(results, tmp_path):
    (tmp_path / "link").symlink_to(results)
    assert listed(tmp_path) == []


def test_no_folder_and_an_empty_one(tmp_path):
    done = CliRunner().invoke(app, ["ls", str(tmp_path)])
    assert (done.exit_code, done.output) == (0, f"{tmp_path}: no run and no campaign in it\n")
    with pytest.raises(InputError, match="no such folder; desim run and desim sweep leave one"):
        listed(tmp_path / "nowhere")


def test_two_campaigns_are_compared_vector_by_vector(results):
    found = desim.compare(results / "few", results / "more")
    assert [key.key for key in found.keys] == ["base", "iterations"]
    assert found.parameters == ("robots",)
    pairs = list(found.pairs("exploration_cost_m"))
    assert [pair.levels for pair in pairs] == [{"robots": 1}, {"robots": 2}]
    assert [pair.runs for pair in pairs] == [(1, 2)] * 2
    costs = desim.Campaign(results / "more").runs["exploration_cost_m"]
    assert pairs[0].metric.second == pytest.approx(costs[:2].mean())
    done = CliRunner().invoke(app, ["compare", str(results / "few"), str(results / "more")])
    assert done.exit_code == 0 and "desim report" in done.output
    assert json.loads(CliRunner().invoke(app, [
        "compare", str(results / "few"), str(results / "more"), "--json"]).output)["metrics"]


def test_a_run_is_not_compared_with_a_campaign(results):
    run = by_status(results, "finished")[0].path
    with pytest.raises(InputError, match=f"{run} is a run, {results / 'few'} a campaign; wanted: "
                                         "two runs or two campaigns"):
        desim.compare(results / "few", run)
