"""A table of what Wi-Fi does to traffic, from the campaign of traffic_wifi.yaml.

    python scenarios/studies/traffic_wifi_table.py results/traffic_wifi

Prints Markdown: for each network and number of steps that are planned ahead (down), and number of
robots (across), the goals that a fleet reaches in an hour, the mean and the range over the runs.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet


def cell(runs) -> str:
    """The mean of the goals of an hour, with the least and the greatest."""
    goals = [run["goals_per_hour"] for run in runs]
    if not goals:
        return "-"
    return f"{np.mean(goals):.0f} ({min(goals):.0f} to {max(goals):.0f})"


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    robots = sorted({run["robots"] for run in runs}, key=int)
    print("| network | planned | " + " | ".join(f"{count} robots" for count in robots) + " |")
    print("|---" * (2 + len(robots)) + "|")
    for network, ahead in dict.fromkeys((run["network"], run["ahead"]) for run in runs):
        of_row = [run for run in runs if (run["network"], run["ahead"]) == (network, ahead)]
        print(f"| {network} | {ahead} | " + " | ".join(
            cell([run for run in of_row if run["robots"] == count]) for count in robots) + " |")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
