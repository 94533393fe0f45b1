"""The paper's Table 2 beside the campaigns of table2.yaml and table2_speed.yaml.

    python scenarios/paper/table2_table.py results/table2 results/table2_speed

Prints Markdown: for each number of processors of a machine the paper's time and ours, how busy
machines and nodes are, and how often each resource saturated first; then the times against those
with two processors, seed by seed. Of the second campaign, if it is given: for each speed how busy
machines are, and the times with one processor against those with two; last, those of all speeds
together.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
from exploration_times import compare, levels, time_s  # beside this file

from desim.statistics.intervals import t_interval

# Exploration time, s, by processors of a virtual machine (Yan, Fabresse, Laval and Bouraqadi 2017,
# Table 2), with 8, 4, 2 and 1 robots on a node.
_PAPER_S = {1: 489, 2: 349, 4: 350, 8: 384}
_CHOSEN = 2  # processors: the configuration of the paper's experiments

_COLUMNS = ("mean_cpu_percent", "mean_node_cpu_percent", "mean_ram_percent", "missed_ticks",
            "messages_replaced", "mean_rx_kBps")


def row(processors: int, runs) -> str:
    """A row of the table: the runs of one number of processors."""
    times = [time_s(run) for run in runs]
    late = sum(run["exploration_time_s"] is None for run in runs)
    first = Counter(run["saturated_first"] or "nothing" for run in runs)
    return " | ".join([
        f"| {processors}", f"{runs[0]['robots_per_node']}", f"{_PAPER_S[processors]}",
        t_interval(times).text() + (f" ({late} late)" if late else ""),
        f"{100 * (np.mean(times) / _PAPER_S[processors] - 1):+.0f} %",
        *(f"{np.mean([run[column] for run in runs]):.0f}" for column in _COLUMNS),
        ", ".join(f"{name} {count}" for name, count in sorted(first.items()))]) + " |"


def speeds(runs) -> None:
    """Print for each speed how busy machines with one and two processors are, and the times with
    one against those with two."""
    few, many = sorted(levels(runs, "processors"))
    print(f"\n| speed | CPU with {few}, % | missed ticks | CPU with {many}, % | missed ticks |")
    print("|---" * 5 + "|")
    for speed in sorted(levels(runs, "speed")):
        those = [[run for run in runs if (run["processors"], run["speed"]) == (count, speed)]
                 for count in (few, many)]
        print(f"| {speed} |", " | ".join(
            f"{np.mean([run[column] for run in some]):.0f}" for some in those
            for column in ("mean_cpu_percent", "missed_ticks")), "|")
    times = {count: times_by_speed(runs, count) for count in (few, many)}
    compare(f"speed, {few} processor, against {many}", times[few], times[many], Counter(
        str(run["speed"]) for run in runs
        if run["exploration_time_s"] is None and run["processors"] == few))
    compare(f"{few} processor, against {many}", *(
        {"all speeds": geometric_means(times[count].values())} for count in (few, many)), Counter())


def times_by_speed(runs, processors) -> dict[str, dict[int, float]]:
    """Times by speed and by seed, of runs with so many processors."""
    times: dict[str, dict[int, float]] = {}
    for run in runs:
        if run["processors"] == processors:
            times.setdefault(str(run["speed"]), {})[run["seed"]] = time_s(run)
    return dict(sorted(times.items()))


def geometric_means(times) -> dict[int, float]:
    """The geometric means of ``times`` (each by seed), by seed."""
    first, *others = times
    return {seed: float(np.exp(np.mean([np.log(one[seed]) for one in (first, *others)])))
            for seed in first if all(seed in other for other in others)}


def main(campaign: Path, slower: Path | None = None) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    counts = sorted(levels(runs, "processors"))
    print("| processors | robots on a node | the paper, s | time, s | difference | machines' CPU, "
          "% | nodes' CPU, % | RAM, % | missed ticks | unread messages | a robot receives, kB/s | "
          "saturates first |")
    print("|---" * 12 + "|")
    for processors in counts:
        print(row(processors, [run for run in runs if run["processors"] == processors]))
    times = {processors: {run["seed"]: time_s(run) for run in runs
                          if run["processors"] == processors} for processors in counts}
    compare(f"processors, against {_CHOSEN}", {str(one): times[one] for one in counts},
            {str(one): times[_CHOSEN] for one in counts if one != _CHOSEN},
            Counter(str(run["processors"]) for run in runs if run["exploration_time_s"] is None))
    if slower is not None:
        speeds(parquet.read_table(slower / "runs.parquet").to_pylist())


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
