"""The exploration times of computers.yaml at each speed, beside those at the highest one.

    python scenarios/studies/computers_table.py results/computers

Prints Markdown: for each speed the share of time, a geometric mean over pairs of runs of one fleet,
kind of localization and seed, with its 95 % interval, p by Holm, and the number of pairs that are
slower. Pairs of one seed may depend on each other, so that the last column has the interval over
the means of seeds.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
from paired_times import times_of  # beside this file

from desim.statistics.comparisons import Paired, holm, paired


def logarithms(runs, speed) -> dict[tuple, float]:
    """The logarithm of each run's time at one speed, by fleet, localization and seed."""
    own = [run for run in runs if run["speed"] == speed]
    return {(*vector, seed): float(np.log(time_s))
            for vector in dict.fromkeys((run["robots"], run["localization"]) for run in own)
            for seed, time_s in times_of([run for run in own if (
                run["robots"], run["localization"]) == vector]).items()}


def by_seeds(own, reference) -> Paired:
    """The means of ``own`` of each seed, compared with those of ``reference``."""
    seeds = dict.fromkeys(vector[-1] for vector in own)
    return paired(*([np.mean([value for vector, value in side.items() if vector[-1] == seed])
                     for seed in seeds] for side in (own, reference)))


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    *slower, fastest = sorted({run["speed"] for run in runs})
    reference = logarithms(runs, fastest)
    pairs, over_seeds = {}, {}
    for speed in slower:
        own = {vector: value for vector, value in logarithms(runs, speed).items()
               if vector in reference}
        beside = {vector: reference[vector] for vector in own}
        pairs[speed] = paired(list(own.values()), list(beside.values()))
        over_seeds[speed] = by_seeds(own, beside)
    adjusted = holm([1.0 if one.t_p is None else one.t_p for one in pairs.values()])
    print(f"| speed, against {fastest:g} | share of time | p (Holm) | slower | over seeds |")
    print("|---" * 5 + "|")
    for (speed, one), p in zip(pairs.items(), adjusted, strict=True):
        mean, low, high = np.exp([one.difference.mean, one.difference.low, one.difference.high])
        least, most = np.exp([over_seeds[speed].difference.low, over_seeds[speed].difference.high])
        print(f"| {speed:g} | {mean:.2f} ({low:.2f} to {high:.2f}) | {p:.2g} | "
              f"{one.above} of {one.difference.n} | {least:.2f} to {most:.2f} |")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
