"""``desim check``: a folder that is whole, was healed, or lacks something."""

from __future__ import annotations

import shlex

import pytest
from designs import Here, planned
from typer.testing import CliRunner

from desim.campaign.design.metrics import Metrics
from desim.campaign.running.sweep import Sweep
from desim.campaign.running.work import work
from desim.cli import app
from desim.results.row import failure

TEXT = "iterations: 2\n"


def said(*words):
    result = CliRunner().invoke(app, [str(word) for word in words])
    return result.exit_code, result.output.splitlines()


@pytest.fixture
def campaign(tmp_path):
    plan = planned(tmp_path, TEXT)
    with Sweep(plan, Metrics(plan), tmp_path / "out") as sweep:
        sweep.run(Here())
    return tmp_path / "out"


def test_a_whole_campaign(campaign):
    assert said("check", campaign) == (0, [f"{campaign}: a campaign, {name(campaign)}: 2 of 2 "
                                           "folders of runs are whole"])


def test_damage_is_named_file_by_file(campaign):
    one, other = sorted((campaign / "runs" / "small").iterdir())
    (one / "summary.json").write_text("{}")
    (other / "samples.parquet").unlink()
    (campaign / "index.jsonl").open("ab").write(b"cut o")
    mends = "running its scenario again mends it"
    assert said("check", campaign) == (1, [
        f"{campaign}: a campaign, {name(campaign)}: 0 of 2 folders of runs are whole",
        f"{command(campaign)} mends what is damaged and makes what is missing",
        "index.jsonl: 1 lines are damaged",
        f"runs/small/{one.name}: summary.json is not what desim wrote; {mends}",
        f"runs/small/{other.name}: samples.parquet is missing; {mends}"])


def test_failed_runs_are_counted_and_the_command_makes_them_again(tmp_path):
    """Their beginnings are no damage: the next try empties them."""
    plan, failed = planned(tmp_path, "iterations: 3\n"), []

    def failing(task):
        if len(failed) == 2:
            return work(task)
        failed.append(task.run_id)
        return failure(task.run_id, f"boom {len(failed)}")

    campaign = tmp_path / "my out"
    with Sweep(plan, Metrics(plan), campaign) as sweep:
        sweep.run(Here(work=failing))
    (campaign / "runs" / "small" / f"{failed[0]}.partial").mkdir()
    again = f"{command(campaign)} --retry-failed"
    assert said("check", campaign) == (0, [
        f"{campaign}: a campaign, {name(campaign)}: 1 of 1 folders of runs are whole",
        f"2 of 3 runs failed, the first ({failed[0]}): boom 1", f"{again} makes them again"])
    assert said(*shlex.split(again)[1:], "--jobs", 1)[0] == 0
    assert said("check", campaign) == (0, [
        f"{campaign}: a campaign, {name(campaign)}: 3 of 3 folders of runs are whole"])


def test_a_run_that_was_cut_off_is_named(campaign):
    one = sorted((campaign / "runs" / "small").iterdir())[0]
    one.rename(one.with_name("0123456789ab.partial"))
    code, lines = said("check", campaign)
    assert code == 1 and lines[-2:] == [
        f"{one.name}: the run has finished, and its folder is gone",
        "runs/small/0123456789ab.partial: a run that is being written, or was cut off"]


def test_a_run_says_that_it_was_healed_and_what_is_not_its_own(campaign):
    """Made again in place of a damaged folder: the manifest, the command and the check say so."""
    run = sorted((campaign / "runs" / "small").iterdir())[0]
    (run / "summary.json").write_text("{}")
    (run / "mine.txt").write_text("mine")
    code, lines = said("run", run / "scenario.resolved.yaml", "--out", campaign / "runs")
    assert code == 0, lines
    assert ("healed: the earlier folder of this run was damaged (summary.json is not what desim "
            "wrote) and is replaced") in lines
    code, lines = said("check", run)
    assert code == 0 and lines[1:] == [
        "not part of the run, and never removed: mine.txt",
        "healed: it was made again, for the one before was damaged: summary.json is not what "
        "desim wrote"]


def name(campaign):
    from desim.campaign.folder.campaign import Campaign

    return Campaign(campaign).design.name


def command(campaign):
    return f"desim sweep {shlex.quote(str(campaign / 'design.yaml'))} --out " + shlex.quote(
        str(campaign))
