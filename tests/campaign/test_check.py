"""``desim check``: a folder that is whole, was healed, or lacks something."""

from __future__ import annotations

import pytest
from designs import Here, planned
from typer.testing import CliRunner

from desim.campaign.design.metrics import Metrics
from desim.campaign.running.sweep import Sweep
from desim.cli import app

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
        "the sweep of its design mends what is damaged and makes what is missing",
        "index.jsonl: 1 lines are damaged",
        f"runs/small/{one.name}: summary.json is not what desim wrote; {mends}",
        f"runs/small/{other.name}: samples.parquet is missing; {mends}"])


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
