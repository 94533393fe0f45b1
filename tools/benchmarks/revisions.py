"""Is this tree slower than another commit? Both in turns, with an interval of their ratio.

    python tools/bench.py compare REV [--turns N] [part ...]

The machine's speed drifts and other processes disturb it, so single figures of two commits say
little. Turns cancel the drift: each turn measures both, in alternating order, and gives one ratio;
the interval is that of the mean of the logarithms of all ratios (Student's t).
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from desim.statistics.intervals import t_interval

ROOT = Path(__file__).resolve().parents[2]
_MAZE = ["scenarios/maze_30.yaml", "--until", "30s"]
RUNS = {
    "scenarios": {"hello": ["scenarios/hello.yaml"],
                  "maze_8": ["scenarios/maze_8.yaml", "--until", "60s"],
                  "maze_30": _MAZE},
    "middleware": {name: [*_MAZE, *(part for one in settings for part in ("--set", one))]
                   for name, settings in {
                       "ros1": ["middleware.model=ros1"],
                       "dds, fastdds": ["middleware.model=dds"],
                       "dds, cyclonedds": ["middleware.model=dds", "middleware.preset=cyclonedds"],
                       "zenoh": ["middleware.model=zenoh"]}.items()},
}  # other parts are those of bench.py


class Ratio(NamedTuple):
    """Cost here as a share of the cost there: geometric mean and 95 % interval of ``turns``."""

    what: str
    mean: float
    low: float
    high: float
    turns: int


def compare(revision: str, parts: list[str], turns: int) -> Iterator[tuple[str, list[Ratio]]]:
    """The ratios of each part, this tree to ``revision``. Raises ``SystemExit`` if git knows no
    such commit."""
    with checkout(revision) as there:
        for part in parts:
            for tree in (ROOT, there):
                costs(tree, part)  # compiles the kernels
            logs: dict[str, list[float]] = {}
            for turn in range(turns):
                order = (ROOT, there) if turn % 2 else (there, ROOT)
                found = {tree: costs(tree, part) for tree in order}
                for what in found[ROOT].keys() & found[there].keys():
                    logs.setdefault(what, []).append(
                        math.log(found[ROOT][what] / found[there][what]))
            yield part, [_ratio(what, values) for what, values in sorted(logs.items())]


@contextmanager
def checkout(revision: str) -> Iterator[Path]:
    """A folder with the files of ``revision`` and its plug-ins, for as long as it is needed."""
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        added = subprocess.run(["git", "-C", str(ROOT), "worktree", "add", "--detach", str(tree),
                                revision], capture_output=True, text=True)
        if added.returncode:
            raise SystemExit(f"compare: {added.stderr.strip().splitlines()[-1]}")
        try:
            _output(tree, "-c", "from setuptools import setup; setup()", "-q", "egg_info")
            yield tree
        finally:
            subprocess.run(["git", "-C", str(ROOT), "worktree", "remove", "--force", str(tree)],
                           check=True)


def costs(tree: Path, part: str) -> dict[str, float]:
    """CPU time by what it was spent on, in any unit, as the code in ``tree`` needs it."""
    if part in RUNS:
        return {what: _cost_of_run(tree, arguments) for what, arguments in RUNS[part].items()}
    rows = json.loads(_output(tree, "tools/bench.py", "--json", part))[part]
    return {f"{row['what']}: {column}": 1 / value if _is_rate(column) else value
            for row in rows for column, value in row.items()
            if isinstance(value, int | float) and value > 0}


def _cost_of_run(tree: Path, arguments: list[str]) -> float:
    """CPU seconds of a simulated second."""
    with tempfile.TemporaryDirectory() as out:
        _output(tree, "-m", "desim.cli", "run", *arguments, "--quiet", "--out", out)
        (manifest,) = Path(out).glob("*/*/manifest.json")
        run: dict[str, Any] = json.loads(manifest.read_text())
    return 1 / run["real_time_factor"]


def _is_rate(column: str) -> bool:
    return "/s" in column or " per " in column or column.startswith(("times", "N="))


def _output(tree: Path, *arguments: str) -> str:
    """The output of a Python that is started in ``tree`` with its code."""
    done = subprocess.run([sys.executable, *arguments], cwd=tree, capture_output=True, text=True,
                          env=os.environ | {"PYTHONPATH": str(tree)})
    if done.returncode:
        raise SystemExit(f"compare: {' '.join(arguments)} failed in {tree}:\n{done.stderr}")
    return done.stdout


def _ratio(what: str, logs: list[float]) -> Ratio:
    found = t_interval(logs)
    low, high = (found.mean, found.mean) if found.low is None else (found.low, found.high)
    return Ratio(what, math.exp(found.mean), math.exp(low), math.exp(high), len(logs))
