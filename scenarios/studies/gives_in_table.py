"""A table of the resource that gives in first, from the campaign of gives_in.yaml.

    python scenarios/studies/gives_in_table.py results/gives_in

Prints Markdown: for each speed of processors (down) and rate of the network (across), the mean
exploration time in s, and for each resource the number of runs in which it gave in first. A mean
with runs that did not finish is a lower bound, marked by >.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet


def time_s(run) -> float:
    """The exploration time, or the time limit."""
    reached = run["exploration_time_s"]
    return run["simulated_s"] if reached is None else reached


def cell(runs) -> str:
    """The mean time, and what gave in first how often (nothing: no resource did)."""
    if not runs:
        return "–"
    first = Counter(run["gives_in_first"] or "nothing" for run in runs)
    late = any(run["exploration_time_s"] is None for run in runs)
    return ("> " * late + f"{np.mean([time_s(run) for run in runs]):.0f} ("
            + ", ".join(f"{name} {count}" for name, count in sorted(first.items())) + ")")


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    speeds, rates = (list(dict.fromkeys(run[name] for run in runs)) for name in ("speed", "rate"))
    print("| speed |", " | ".join(map(str, rates)), "|")
    print("|---" * (1 + len(rates)) + "|")
    for speed in speeds:
        print(f"| {speed} |", " | ".join(cell([run for run in runs if (
            run["speed"], run["rate"]) == (speed, rate)]) for rate in rates), "|")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
