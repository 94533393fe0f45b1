"""The tables of what a cut of the network costs each strategy, from strategies_cut.yaml's campaign.

    python scenarios/studies/cut_table.py results/strategies_cut
"""

from __future__ import annotations

import sys
from pathlib import Path

import pyarrow.parquet as parquet
from paired_times import share, times_of  # beside this file

from desim.statistics.intervals import t_interval

UNCUT, CUTS = "never", ("for a minute", "for good")


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    times, late = {}, {}
    for name in dict.fromkeys(run["strategy"] for run in runs):
        for cut in (UNCUT, *CUTS):
            mine = [run for run in runs if (run["strategy"], run["cut"]) == (name, cut)]
            times[name, cut] = times_of(mine)
            late[name, cut] = sum(run["exploration_time_s"] is None for run in mine)
    names = list(dict.fromkeys(name for name, _ in times))
    print("| share of the time without a cut |", " | ".join(f"cut {cut}" for cut in CUTS), "|")
    print("|---" * (1 + len(CUTS)) + "|")
    for name in names:
        print(f"| `{name}` |", " | ".join(share(times[name, cut], times[name, UNCUT])
                                          for cut in CUTS), "|")
    print("\n| time, s (late runs) |", " | ".join(f"cut {cut}" for cut in (UNCUT, *CUTS)), "|")
    print("|---" * (2 + len(CUTS)) + "|")
    for name in names:
        print(f"| `{name}` |", " | ".join(
            t_interval(list(times[name, cut].values())).text()
            + (f" ({late[name, cut]})" if late[name, cut] else "") for cut in (UNCUT, *CUTS)), "|")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
