"""A table of the discovery on one access point, from the campaign of discovery.yaml.

    python scenarios/studies/discovery_table.py results/discovery

Prints Markdown: for each number of robots and kind of discovery the ordered pairs of participants
that have found each other at the end and those that there are, the second from which on all had,
the bytes of discovery in MB, and the share of time in which the air was busy.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet


def row(run) -> str:
    """One run."""
    all_s, sent_mb = run["process_pairs_all_s"], run["discovery_bytes"] / 1e6
    return " | ".join([
        str(run["robots"]), f"`{run['discovery']}`",
        f"{run['process_pairs_matched']:.0f} of {run['process_pairs_pairs']:.0f}",
        "never" if all_s is None or np.isnan(all_s) else f"{all_s:.0f} s",
        f"{sent_mb:.{0 if sent_mb >= 10 else 1}f} MB",
        f"{100 * run['utilisation_air_mean']:.0f} %"])


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    print("| robots | discovery | pairs found | all from | sent | air busy |")
    print("|---" * 6 + "|")
    for run in sorted(runs, key=lambda run: (run["robots"], run["discovery"] == "server")):
        print(f"| {row(run)} |")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
