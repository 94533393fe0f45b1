"""A table of the kinds of map sharing, from the campaign of sharing.yaml, as far as it is done.

    python scenarios/studies/sharing_table.py results/sharing
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet

from desim.statistics.intervals import t_interval


def sent_mb(run) -> float:
    """The bytes of all topics of map sharing that were delivered, in MB."""
    return sum(bytes_ or 0 for column, bytes_ in run.items()
               if "map_exchange" in column and column.endswith("_bytes")) / 1e6


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    print("| model | fusion | time (s) | sent (MB) | map age (s) | wrong cells | quality |")
    print("|---|---|---|---|---|---|---|")
    for kind, fusion in dict.fromkeys((run["kind"], run["fusion"]) for run in runs):
        some = [run for run in runs if (run["kind"], run["fusion"]) == (kind, fusion)]
        time_s, wrong = (t_interval([run[key] for run in some])
                         for key in ("exploration_time_s", "map_error_cells"))
        print(f"| {kind} | {fusion} | {time_s.text()} "
              f"| {np.mean([sent_mb(run) for run in some]):.1f} "
              f"| {np.mean([run['map_age_s'] for run in some]):.1f} "
              f"| {wrong.text()} "
              f"| {np.mean([run['map_quality'] for run in some]):.3f} |")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
