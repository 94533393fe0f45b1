"""What a cut of the network costs each strategy, from the campaign of strategies_cut.yaml:

    python scenarios/studies/cut_table.py results/strategies_cut
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet

from desim.statistics.comparisons import paired
from desim.statistics.intervals import t_interval

UNCUT, CUTS = "never", ("for a minute", "for good")


def times_of(runs) -> dict[int, float]:
    """The exploration time by seed; the time limit where the maze was not explored."""
    return {run["seed"]: run["simulated_s"] if run["exploration_time_s"] is None
            else run["exploration_time_s"] for run in runs}


def share(cut: dict[int, float], whole: dict[int, float]) -> str:
    """The geometric mean of the times of equal seeds, divided, with its 95 % interval."""
    seeds = [seed for seed in cut if seed in whole]
    pair = paired(*(np.log([times[seed] for seed in seeds]) for times in (cut, whole)))
    low, mean, high = np.exp([pair.difference.low, pair.difference.mean, pair.difference.high])
    return f"{mean:.2f} ({low:.2f} to {high:.2f})"


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    heads = " | ".join(f"cut {cut}, s | share | late" for cut in CUTS)
    print("| strategy | uncut, s |", heads, "|")
    print("|---" * (2 + 3 * len(CUTS)) + "|")
    for name in dict.fromkeys(run["strategy"] for run in runs):
        mine = [run for run in runs if run["strategy"] == name]
        whole = times_of([run for run in mine if run["cut"] == UNCUT])
        cells = [f"{t_interval(list(whole.values())).mean:.0f}"]
        for cut in CUTS:
            hurt = [run for run in mine if run["cut"] == cut]
            times = times_of(hurt)
            late = sum(run["exploration_time_s"] is None for run in hurt)
            cells += [f"{t_interval(list(times.values())).mean:.0f}", share(times, whole),
                      str(late) if late else ""]
        print(f"| `{name}` |", " | ".join(cells), "|")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
