"""A table of the local planners, from the campaign of local_planners.yaml, as far as it is done.

    python scenarios/studies/local_planners_table.py results/local_planners
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet


def spread(values, form: str) -> str:
    """The mean, with the least and the greatest of few values."""
    return f"{np.mean(values):{form}} ({min(values):{form}} to {max(values):{form}})"


def row(name: str, robots: float, runs) -> str:
    """The figures of one local planner and size of fleet."""
    times = [run["exploration_time_s"] for run in runs]
    speeds = [run["exploration_cost_m"] / robots / run["simulated_s"] for run in runs]
    return " | ".join((
        f"| {robots:g} | `{name}`", spread(times, ".0f"), spread(speeds, ".2f"),
        spread([run["collisions"] for run in runs], ".0f"),
        spread([run["recoveries"] for run in runs], ".0f"),
        spread([run["stood_s"] for run in runs], ".0f"), "")).rstrip()


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    print("| robots | local planner | exploration time, s | m/s of a robot | collisions "
          "| recoveries | longest standing, s |")
    print("|---" * 7 + "|")
    for robots, name in dict.fromkeys((run["robots"], run["local"]) for run in runs):
        print(row(name, robots, [run for run in runs
                                 if (run["robots"], run["local"]) == (robots, name)]))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
