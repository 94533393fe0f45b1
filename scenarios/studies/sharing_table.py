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


def row(kind: str, by_fusion) -> str:
    """The means of a kind, each for all fusions, or once where these are equal."""
    times = [t_interval([run["exploration_time_s"] for run in runs]).text() for runs in by_fusion]
    columns = (times,
               [f"{np.mean([sent_mb(run) for run in runs]):.3g}" for runs in by_fusion],
               [f"{np.mean([run['map_age_s'] for run in runs]):.1f}" for runs in by_fusion],
               [t_interval([run["map_error_cells"] for run in runs]).text() for runs in by_fusion],
               [f"{np.mean([run['map_quality'] for run in runs]):.3f}" for runs in by_fusion])
    return f"| {kind} | " + " | ".join(
        "; ".join(cells if len(set(cells)) > 1 else cells[:1]) for cells in columns) + " |"


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    kinds, fusions = (dict.fromkeys(run[name] for run in runs) for name in ("kind", "fusion"))
    print(f"Each cell has the values for the fusions {'; '.join(fusions)}, or one for all.\n")
    print("| model | exploration time, s | sent, MB | map age, s | wrong cells | map quality |")
    print("|---" * 6 + "|")
    for kind in kinds:
        print(row(kind, [[run for run in runs if (run["kind"], run["fusion"]) == (kind, fusion)]
                         for fusion in fusions]))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
