"""The tables of what a short radio costs each strategy, from the campaign of range.yaml.

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
    times = {(reach, name): times_of(
        [run for run in runs if (run["range"], run["strategy"]) == (reach, name)])
        for reach in ranges for name in strategies}
    heads = " | ".join(f"`{name}`" for name in strategies)
    print(f"| share of time, against {ranges[-1]} | {heads} |")
    print("|---" * (1 + len(strategies)) + "|")
    for reach in ranges[:-1]:
        print(f"| {reach} |", " | ".join(share(times[reach, name], times[ranges[-1], name])
                                         for name in strategies), "|")
    print(f"\n| time, s | {heads} |")
    print("|---" * (1 + len(strategies)) + "|")
    for reach in ranges:
        print(f"| {reach} |", " | ".join(t_interval(list(times[reach, name].values())).text()
                                         for name in strategies), "|")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
