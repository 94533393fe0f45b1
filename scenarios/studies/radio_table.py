"""Tables of docs/defaults.md: the levels of a parameter beside one of them, seed by seed.

    python scenarios/studies/radio_table.py results/defaults changed nothing
    python scenarios/studies/radio_table.py results/presets preset indoor
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet

from desim.statistics.comparisons import holm, paired
from desim.statistics.intervals import t_interval

METRICS = {"exploration time (s)": ("exploration_time_s", 1.0),  # column of the runs, and factor
           "delivered (%)": ("delivered", 100.0), "map age (s)": ("map_age_s", 1.0)}


def main(campaign: Path, parameter: str, beside: str) -> None:
    runs = sorted(parquet.read_table(campaign / "runs.parquet").to_pylist(),
                  key=lambda run: run["seed"])
    levels = [beside, *(level for level in dict.fromkeys(run[parameter] for run in runs)
                        if level != beside)]
    means: dict[str, list[str]] = {level: [] for level in levels}
    apart: dict[str, list[str]] = {level: [] for level in levels}
    for metric, factor in METRICS.values():
        if any(run[metric] is None for run in runs):
            sys.exit(f"{metric} has no value in some runs, which ended before")
        values = {level: [factor * run[metric] for run in runs if run[parameter] == level]
                  for level in levels}
        found = {level: paired(values[level], values[beside]) for level in levels[1:]}
        corrected = holm(np.array([1.0 if one.t_p is None else one.t_p for one in found.values()]))
        for level in levels:
            means[level].append(t_interval(values[level]).text())
        for (level, one), p in zip(found.items(), corrected, strict=True):
            apart[level].append(one.difference.text() + (" *" if p < 0.05 else ""))
    print(f"| {parameter} |", " | ".join(METRICS), "|")
    print("|---" * (1 + len(METRICS)) + "|")
    for level in levels:
        print(f"| {level} |", " | ".join(apart[level] or means[level]), "|")
    print("\n| means |", " | ".join(METRICS), "|")
    print("|---" * (1 + len(METRICS)) + "|")
    for level in levels:
        print(f"| {level} |", " | ".join(means[level]), "|")


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
