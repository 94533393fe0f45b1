"""The cost of commits over time.

    python tools/bench.py history [--turns N] REV ...

measures commits in turns and adds the best of each to `docs/benchmarks.csv`, with the
machine and with what bare SimPy needs there for an event. Figures of different machines, or of one
on different days, are to be compared through those of a commit that both have measured.
"""

from __future__ import annotations

import csv
import subprocess
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path

from benchmarks.revisions import ROOT, RUNS, checkout, costs

FILE = ROOT / "docs" / "benchmarks.csv"
COLUMNS = ("measured", "cpu", "simpy_us", "commit", "committed", "what", "cost")
PARTS = (*RUNS, "message")


def measure(revisions: list[str], turns: int) -> Iterator[tuple[str, str, float]]:
    """The commit, what was measured and the least cost of ``turns`` in turns: CPU seconds of a
    simulated second, or microseconds of a message."""
    with ExitStack() as folders:
        trees = {commit_of(revision)[0]: folders.enter_context(checkout(revision))
                 for revision in revisions}
        best: dict[tuple[str, str], float] = {}
        for turn in range(turns + 1):
            for commit, tree in trees.items():
                for part in PARTS:
                    for what, cost in costs(tree, part).items():
                        if turn:  # the first one compiles
                            key = commit, f"{part}: {what}"
                            best[key] = min(cost, best.get(key, cost))
    for (commit, what), cost in best.items():
        yield commit, what, cost


def commit_of(revision: str) -> tuple[str, str]:
    """A commit's short name, and its day. Raises ``SystemExit`` if git knows no such commit."""
    found = subprocess.run(["git", "-C", str(ROOT), "log", "-1", "--format=%h %cs", revision, "--"],
                           capture_output=True, text=True)
    if found.returncode:
        raise SystemExit(f"history: {found.stderr.strip().splitlines()[-1]}")
    name, day = found.stdout.split()
    return name, day


def add(day: str, cpu: str, simpy_us: float, found: Iterable[tuple[str, str, float]],
        file: Path = FILE) -> None:
    """Write what was measured on ``day`` at the end of the file."""
    found = list(found)
    is_new = not file.exists()
    with file.open("a", newline="") as rows:
        writer = csv.writer(rows, lineterminator="\n")
        if is_new:
            writer.writerow(COLUMNS)
        for commit, what, cost in found:
            writer.writerow((day, cpu, f"{simpy_us:.3f}", *commit_of(commit), what, f"{cost:.4g}"))


def read(file: Path = FILE) -> list[dict[str, str]]:
    """All measurements, oldest first. Raises ``SystemExit`` for a file with other columns."""
    if not file.exists():
        return []
    with file.open(newline="") as rows:
        reader = csv.DictReader(rows)
        if tuple(reader.fieldnames or ()) != COLUMNS:
            raise SystemExit(f"history: {file} has columns {reader.fieldnames}, wanted: {COLUMNS}")
        return list(reader)


def table(rows: list[dict[str, str]]) -> list[dict[str, object]]:
    """The cost of each commit at its last measurement: a row for each figure, a column for each
    commit."""
    commits = {row["commit"]: row["committed"] for row in rows}
    cost = {(row["what"], row["commit"]): row["cost"] for row in rows}
    return [{"what": what, **{commit: cost.get((what, commit), "") for commit in commits}}
            for what in dict.fromkeys(row["what"] for row in rows)]
