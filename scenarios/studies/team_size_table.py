"""The table of exploration times by team size, from team_size.yaml's campaign.

    python scenarios/studies/team_size_table.py results/team_size
"""

from __future__ import annotations

import sys
from pathlib import Path

import pyarrow.parquet as parquet
from paired_times import share, times_of  # beside this file

from desim.statistics.intervals import t_interval

REFERENCE, OTHERS = "nearest_frontier", ("minpos", "market")


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    print(f"| robots | `{REFERENCE}`, s |", " | ".join(
        f"`{name}`, s | share of the time" for name in OTHERS), "|")
    print("|---" * (2 + 2 * len(OTHERS)) + "|")
    for robots in sorted({run["robots"] for run in runs}):
        times = {name: times_of(run for run in runs if (run["strategy"], run["robots"])
                                == (name, robots)) for name in (REFERENCE, *OTHERS)}
        cells = [t_interval(list(times[REFERENCE].values())).text()]
        for name in OTHERS:
            cells += [t_interval(list(times[name].values())).text(),
                      share(times[name], times[REFERENCE])]
        print(f"| {robots} |", " | ".join(cells), "|")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
