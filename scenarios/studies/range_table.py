"""What a short radio costs each strategy, from the campaign of range.yaml:

    python scenarios/studies/range_table.py results/range
"""

from __future__ import annotations

import sys
from pathlib import Path

import pyarrow.parquet as parquet
from localization_table import share, times_of  # beside this file

from desim.statistics.intervals import t_interval


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    strategies, ranges_m = (list(dict.fromkeys(run[name] for run in runs))
                            for name in ("strategy", "range"))
    print("| range, m |", " | ".join(f"`{name}`, s | share" for name in strategies), "|")
    print("|---" * (1 + 2 * len(strategies)) + "|")
    for range_m in ranges_m:
        cells = []
        for name in strategies:
            times, farthest = (times_of([run for run in runs if (
                run["strategy"], run["range"]) == (name, reach)])
                for reach in (range_m, max(ranges_m)))
            late = sum(run["exploration_time_s"] is None for run in runs
                       if (run["strategy"], run["range"]) == (name, range_m))
            cells += [t_interval(list(times.values())).text()
                      + (f" ({late} late)" if late else ""),
                      "1" if range_m == max(ranges_m) else share(times, farthest)]
        print(f"| {range_m} |", " | ".join(cells), "|")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
