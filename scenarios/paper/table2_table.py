"""The paper's Table 2 beside the campaigns of table2.yaml and table2_speed.yaml.

    python scenarios/paper/table2_table.py results/table2 results/table2_speed

Prints Markdown: for each number of processors of a machine the paper's time and ours, how busy
machines are, how often each resource saturated first, and the times against those with two
processors, seed by seed; then how busy nodes and programs are. Of the second campaign, if it is
given: for each speed the times with one processor against those with two, and how busy machines
are; last, those of all speeds together.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
from exploration_times import against, compare, levels, time_s  # beside this file

from desim.statistics.intervals import t_interval

# Exploration time, s, by processors of a virtual machine (Yan, Fabresse, Laval and Bouraqadi 2017,
# Table 2), with 8, 4, 2 and 1 robots on a node.
_PAPER_S = {1: 489, 2: 349, 4: 350, 8: 384}
_CHOSEN = 2  # processors: the configuration of the paper's experiments

_BUSY = {"nodes' CPU, %": "mean_node_cpu_percent", "missed ticks": "missed_ticks",
         "unread messages": "messages_replaced", "a robot receives, kB/s": "mean_rx_kBps"}


def mean(runs, column: str) -> str:
    return f"{np.mean([run[column] for run in runs]):.0f}"


def row(processors: int, runs, share: str, p: str) -> str:
    """A row of the table: the runs of one number of processors."""
    times = [time_s(run) for run in runs]
    late = sum(run["exploration_time_s"] is None for run in runs)
    first = Counter(run["saturated_first"] or "nothing" for run in runs)
    return " | ".join([
        f"| {processors}", f"{runs[0]['robots_per_node']}", f"{_PAPER_S[processors]}",
        t_interval(times).text() + (f" ({late} late)" if late else ""),
        f"{100 * (np.mean(times) / _PAPER_S[processors] - 1):+.0f} %",
        mean(runs, "mean_cpu_percent"), mean(runs, "mean_ram_percent"),
        ", ".join(f"{name} {count}" for name, count in sorted(first.items())), share, p]) + " |"


def speeds(runs) -> None:
    """Print for each speed the times with one processor, against those with two, and how busy both
    kinds of machines are; then the times of all speeds together."""
    few, many = sorted(levels(runs, "processors"))
    times = {count: times_by_speed(runs, count) for count in (few, many)}
    shares = against(times[few], times[many])
    print(f"\n| speed | time with {few}, s | against {many} | p (Holm) | CPU with {few}, % "
          f"| missed ticks | CPU with {many}, % | missed ticks |")
    print("|---" * 8 + "|")
    for speed, own in times[few].items():
        those = [[run for run in runs if (run["processors"], str(run["speed"])) == (count, speed)]
                 for count in (few, many)]
        late = sum(run["exploration_time_s"] is None for run in those[0])
        busy = [mean(some, column) for some in those
                for column in ("mean_cpu_percent", "missed_ticks")]
        print(f"| {speed} |", t_interval(list(own.values())).text()
              + (f" ({late} late)" if late else ""), "|",
              " | ".join((*shares.get(speed, ("", "")), *busy)), "|")
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
    own = {count: [run for run in runs if run["processors"] == count]
           for count in sorted(levels(runs, "processors"))}
    times = {count: {run["seed"]: time_s(run) for run in some} for count, some in own.items()}
    shares = against(times, {count: times[_CHOSEN] for count in own if count != _CHOSEN})
    print("| processors | robots on a node | the paper, s | time, s | difference | CPU, % | RAM, % "
          f"| saturates first | time, against {_CHOSEN} | p (Holm) |")
    print("|---" * 10 + "|")
    for count, some in own.items():
        print(row(count, some, *shares.get(count, ("1", ""))))
    print("\n| processors |", " | ".join(_BUSY), "|")
    print("|---" * (1 + len(_BUSY)) + "|")
    for count, some in own.items():
        print(f"| {count} |", " | ".join(mean(some, column) for column in _BUSY.values()), "|")
    if slower is not None:
        speeds(parquet.read_table(slower / "runs.parquet").to_pylist())


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
