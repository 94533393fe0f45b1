"""Completions: folders of runs and campaigns, files, names, and a shell that asks for them."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from desim.commands import completion


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Two runs, a campaign with a run, and a scenario."""
    for name in ("hello/0123456789ab", "hello/123456789abc", "study/runs/hello/23456789abcd"):
        (tmp_path / "results" / name).mkdir(parents=True)
        (tmp_path / "results" / name / "manifest.json").write_text("{}")
    (tmp_path / "results" / "study" / "design.yaml").write_text("")
    (tmp_path / "mine.yaml").write_text("")
    (tmp_path / "notes.txt").write_text("")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_folders_of_runs_and_campaigns(here):
    runs = ["results/hello/0123456789ab", "results/hello/123456789abc"]
    assert completion.run_folders("") == completion.run_folders("results/he") == runs
    assert completion.run_folders("results/hello/1") == runs[1:]
    assert completion.run_folders("results/study/") == ["results/study/runs/hello/23456789abcd"]
    assert completion.campaign_folders("r") == ["results/study"]
    assert completion.result_folders("") == [*runs, "results/study"]
    assert completion.run_folders("elsewhere/") == []


def test_files_and_folders_on_the_way(here):
    assert completion.yaml_files("") == ["mine.yaml", "results/"]
    assert completion.yaml_files("results/study/") == ["results/study/design.yaml",
                                                       "results/study/runs/"]
    assert completion.yaml_files("nowhere/") == []


def test_names():
    assert completion.plugin_names("nearest") == ["nearest_frontier"]
    assert [name for name, _ in completion.shipped_names("hell")] == ["hello"]


def test_a_shell_asks_and_nothing_heavy_is_imported(here):
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-c",
         "from desim.cli import app; app(prog_name='desim')"],
        text=True, capture_output=True, check=False,
        env={**os.environ, "_DESIM_COMPLETE": "complete_bash",
             "COMP_WORDS": "desim trace results/", "COMP_CWORD": "2"})
    assert done.stdout.split() == ["results/hello/0123456789ab", "results/hello/123456789abc"]
    assert not {"numba", "matplotlib", "networkx", "numpy"} & {
        line.split("|")[-1].strip() for line in done.stderr.splitlines()}
