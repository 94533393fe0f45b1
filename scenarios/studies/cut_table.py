"""The table of what a cut of the network costs each strategy, from strategies_cut.yaml's campaign.

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
    heads = " | ".join(f"cut {cut}, s | share | late" for cut in CUTS)
    print("| strategy | uncut, s |", heads, "|")
    print("|---" * (2 + 3 * len(CUTS)) + "|")
    for name in dict.fromkeys(run["strategy"] for run in runs):
        mine = [run for run in runs if run["strategy"] == name]
        whole = times_of([run for run in mine if run["cut"] == UNCUT])
        cells = [t_interval(list(whole.values())).text()]
        for cut in CUTS:
            hurt = [run for run in mine if run["cut"] == cut]
            times = times_of(hurt)
            late = sum(run["exploration_time_s"] is None for run in hurt)
            cells += [t_interval(list(times.values())).text(), share(times, whole),
                      str(late) if late else ""]
        print(f"| `{name}` |", " | ".join(cells), "|")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
