"""Stray files in a campaign's folder: of a file browser, an editor, a user."""

import os

import pytest
from designs import Here, planned, written
from typer.testing import CliRunner

import desim
from desim.campaign.design.metrics import Metrics
from desim.campaign.running.sweep import Sweep
from desim.cli import app

TEXT = "parameters: {robots: {key: fleet.size, values: [1, 2]}}\niterations: 2\n"
STRAYS = (".DS_Store", "Thumbs.db", "notes~", ".notes.txt.swp", "#notes#", "mine", "abcdef012345")


def littered(folder):
    """With files and folders of these names, and links that lead nowhere or away."""
    for i, name in enumerate(STRAYS):
        stray = folder / name
        if i % 2:
            stray.mkdir()
            (stray / "mine.txt").write_text("mine")
        else:
            stray.write_text("mine")
    (folder / "nowhere").symlink_to("gone")
    (folder / "away").symlink_to(os.sep)


@pytest.fixture
def campaign(tmp_path):
    plan = planned(tmp_path, TEXT)
    with Sweep(plan, Metrics(plan), tmp_path / "out") as sweep:
        sweep.run(Here())
    runs = tmp_path / "out" / "runs"
    one = sorted((runs / "small").iterdir())[0]
    for folder in (one, runs / "small", runs, tmp_path / "out"):
        littered(folder)
    return tmp_path / "out", (tmp_path / "out" / "runs.parquet").read_bytes()


def said(*words) -> str:
    done = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output


def count(folder) -> int:
    return sum(1 for _ in folder.rglob("*"))


def test_they_disturb_nobody_and_stay(campaign, tmp_path):
    out, table = campaign
    design, before = written(tmp_path, TEXT), count(out)
    listed = said("sweep", design, "--out", out, "--dry-run")
    assert "4 runs, 4 done, 0 of them failed" in listed
    assert "4 runs, 4 done already" in said("sweep", design, "--out", out, "--jobs", 1)
    assert (out / "runs.parquet").read_bytes() == table
    assert count(out) == before
    (out / "index.jsonl").unlink()  # made again from the folders
    assert "4 runs, 4 done already" in said("sweep", design, "--out", out, "--jobs", 1)
    assert (out / "runs.parquet").read_bytes() == table and count(out) == before
    assert len(list(desim.Campaign(out))) == 4
    said("report", out)
    assert (out / "report" / "report.html").is_file()


def test_a_run_that_is_made_again_keeps_them(campaign, tmp_path):
    out, table = campaign
    one = next(path for path in sorted((out / "runs" / "small").iterdir())
               if (path / "summary.json").is_file() and (path / "mine").exists())
    (one / "summary.json").write_text("[]")
    text = said("sweep", written(tmp_path, TEXT), "--out", out, "--jobs", 1)
    assert "1 run is damaged; what is missing is made again" in text
    assert (out / "runs.parquet").read_bytes() == table
    assert all((one / name).exists() or list(out.rglob(name)) for name in STRAYS)
    assert sum(1 for path in out.rglob("mine.txt")) == 4 * sum(i % 2 for i in range(len(STRAYS)))
