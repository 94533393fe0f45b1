"""The exploration times of computers.yaml at each speed, beside those at the highest one.

    python scenarios/studies/computers_table.py results/computers

Prints Markdown: for each speed what ``paired_times.print_shares`` says, over pairs of runs of one
fleet, kind of localization and seed.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pyarrow.parquet as parquet
from paired_times import print_shares, time_s  # beside this file


def main(campaign: Path) -> None:
    times: dict = {}
    for run in parquet.read_table(campaign / "runs.parquet").to_pylist():
        vector = run["robots"], run["localization"]
        times.setdefault(run["speed"], {})[vector, run["seed"]] = time_s(run)
    *slower, fastest = sorted(times)
    print_shares(f"speed, against {fastest:g}", {f"{speed:g}": times[speed] for speed in slower},
                 times[fastest])


if __name__ == "__main__":
    main(Path(sys.argv[1]))
