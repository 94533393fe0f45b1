"""The tables of docs/slam.md, from the campaign of localization.yaml as far as it is done.

    python scenarios/studies/localization_table.py results/localization
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
from paired_times import share, times_of  # beside this file

from desim.statistics.intervals import t_interval

REFERENCE, WALK = "ground_truth", ", walk"
MEASURES = {"ate_m": 3, "heading_rms_rad": 4, "map_quality": 3, "wall_error_median_m": 2,
            "wall_error_p95_m": 2}  # with their digits


def measured(runs, key: str, digits: int) -> str:
    """The mean over runs, and the largest; of the quality, the smallest."""
    values = [run[key] for run in runs if run[key] is not None]
    if not values:
        return ""
    worst = min(values) if key == "map_quality" else max(values)
    return f"{np.mean(values):.{digits}f} ({worst:.{digits}f})"


def summary(runs) -> None:
    """Print time, share of ground truth's time, and position error of each terrain and kind of
    localization; those with a random walk in columns beside the others."""
    kinds = dict.fromkeys(run["localization"] for run in runs)
    noises = ["", WALK] if any(kind.endswith(WALK) for kind in kinds) else [""]
    print("| terrain | localization |", " | ".join(
        f"time{noise}, s | share | ate_m" for noise in noises), "|")
    print("|---" * (2 + 3 * len(noises)) + "|")
    for terrain in dict.fromkeys(run["terrain"] for run in runs):
        here = [run for run in runs if run["terrain"] == terrain]
        reference = times_of([run for run in here if run["localization"] == REFERENCE])
        for kind in kinds:
            if not kind.endswith(WALK):
                cells = [cell for noise in noises for cell in three(
                    [run for run in here if run["localization"] == kind + noise], reference)]
                print(f"| {terrain} | {kind} |", " | ".join(cells), "|")


def three(runs, reference) -> tuple[str, str, str]:
    """Time with the late runs, share of the reference's time and position error; empty cells
    without runs."""
    if not runs:
        return "", "", ""
    times, late = times_of(runs), sum(run["exploration_time_s"] is None for run in runs)
    return (t_interval(list(times.values())).text() + (f" ({late} late)" if late else ""),
            "1" if times == reference else share(times, reference),
            measured(runs, "ate_m", MEASURES["ate_m"]))


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    summary(runs)
    for terrain in dict.fromkeys(run["terrain"] for run in runs):
        here = [run for run in runs if run["terrain"] == terrain]
        reference = times_of([run for run in here if run["localization"] == REFERENCE])
        print(f"\n**{terrain}**, mean (worst) of {len(reference)} seeds\n")
        print("| localization | time, s | late | share of ground truth's time |",
              " | ".join(MEASURES), "|")
        print("|---" * (4 + len(MEASURES)) + "|")
        for name in dict.fromkeys(run["localization"] for run in here):
            mine = [run for run in here if run["localization"] == name]
            times = times_of(mine)
            late = sum(run["exploration_time_s"] is None for run in mine)
            print(f"| {name} | {t_interval(list(times.values())).text()} | {late or ''} |",
                  "1" if name == REFERENCE else share(times, reference), "|",
                  " | ".join(measured(mine, key, digits) for key, digits in MEASURES.items()), "|")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
