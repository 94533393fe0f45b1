"""The file of measurements: what is added is read again, and a foreign file is refused."""

from __future__ import annotations

import subprocess
import sys

import pytest
from benchmarks import history

FOUND = [("6e12754", "scenarios: hello", 0.00312345), ("4c4582f", "scenarios: hello", 0.005)]


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.setattr(history, "commit_of", lambda revision: (revision, "2026-11-23"))
    return tmp_path / "benchmarks.csv"


def test_what_is_added_is_read_again_oldest_first(file):
    history.add("2026-11-23", "a CPU, of some kind", 0.54, FOUND, file)
    history.add("2026-11-24", "another", 0.5, [("6e12754", "scenarios: hello", 0.002)], file)
    rows = history.read(file)
    assert [(row["measured"], row["cpu"], row["commit"], row["cost"]) for row in rows] == [
        ("2026-11-23", "a CPU, of some kind", "6e12754", "0.003123"),
        ("2026-11-23", "a CPU, of some kind", "4c4582f", "0.005"),
        ("2026-11-24", "another", "6e12754", "0.002")]
    assert history.table(rows) == [
        {"what": "scenarios: hello", "6e12754": "0.002", "4c4582f": "0.005"}]


def test_there_may_be_no_file(file):
    assert history.read(file) == []


def test_a_file_with_other_columns_is_refused(file):
    file.write_text("commit,cost\n")
    with pytest.raises(SystemExit, match="has columns .'commit', 'cost'., wanted: "):
        history.read(file)


def test_a_commit_that_git_does_not_know_is_refused():
    with pytest.raises(SystemExit, match="^history: .*no-such-commit"):
        history.commit_of("no-such-commit")


def test_the_help_names_all_that_bench_can_do(repository):
    done = subprocess.run([sys.executable, repository / "tools" / "bench.py", "--help"], text=True,
                          capture_output=True, check=True)
    for form in ("fleets --figure FILE", "compare REV [--turns N]", "history [REV ...]", "beacons"):
        assert form in done.stdout
