"""The table of what a short radio costs each strategy, from the campaign of range.yaml.

    python scenarios/studies/range_table.py results/range
"""

from __future__ import annotations

import sys
from pathlib import Path

import pyarrow.parquet as parquet
from paired_times import share, times_of  # beside this file

from desim.statistics.intervals import t_interval


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    strategies, ranges = (list(dict.fromkeys(run[name] for run in runs))
                            for name in ("strategy", "range"))
    farthest = ranges[-1]
    print("| range |", " | ".join(f"`{name}`, s | share" for name in strategies), "|")
    print("|---" * (1 + 2 * len(strategies)) + "|")
    for reach in ranges:
        cells = []
        for name in strategies:
            times, unlimited = (times_of([run for run in runs if (
                run["strategy"], run["range"]) == (name, each)]) for each in (reach, farthest))
            cells += [t_interval(list(times.values())).text(),
                      "1" if reach == farthest else share(times, unlimited)]
        print(f"| {reach} |", " | ".join(cells), "|")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
