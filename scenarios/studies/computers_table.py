"""The tables of docs/studies/computers.md, from the campaign of computers.yaml.

    python scenarios/studies/computers_table.py results/computers

Prints Markdown: for each speed what ``paired_times.print_shares`` says, over pairs of runs of one
fleet, kind of localization and seed; then mean times by localization, speed and fleet, and the
range over fleets of the mean use of a robot's processors.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
from paired_times import print_shares, time_s  # beside this file


def means(runs) -> None:
    """Print the mean times, and how busy processors are, by localization, speed and fleet."""
    fleets = sorted({run["robots"] for run in runs})
    print("\n| mean time, s | speed |", " | ".join(map(str, fleets)), "robots | CPU, % |")
    print("|---" * (3 + len(fleets)) + "|")
    for kind, speed in sorted({(run["localization"], run["speed"]) for run in runs}):
        some = [[run for run in runs if (run["localization"], run["speed"], run["robots"]) == (
            kind, speed, size)] for size in fleets]
        busy = [np.mean([run["mean_cpu_percent"] for run in own]) for own in some]
        print(f"| {kind} | {speed:g} |",
              " | ".join(f"{np.mean([time_s(run) for run in own]):.0f}" for own in some),
              f"| {min(busy):.2g} to {max(busy):.2g} |")


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    times: dict = {}
    for run in runs:
        vector = run["robots"], run["localization"]
        times.setdefault(run["speed"], {})[vector, run["seed"]] = time_s(run)
    *slower, fastest = sorted(times)
    print_shares(f"speed, against {fastest:g}", {f"{speed:g}": times[speed] for speed in slower},
                 times[fastest])
    means(runs)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
