"""A table of what roaming costs, from the campaign of roaming.yaml.

    python scenarios/studies/roaming_table.py results/roaming

Prints Markdown: for each way to roam the means over the runs of handovers, of their gaps, and for
each middleware of the longest latency of a topic and of packets lost.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet


def row(name: str, runs, middlewares) -> str:
    """The means of a way to roam."""
    def mean(key, chosen=runs):
        return float(np.mean([run.get(key) or 0 for run in chosen]))

    count = mean("handover_gap_s_count")
    each_ms = 1e3 * mean("handover_gap_s_total") / count if count else 0
    longest = max(run["handover_gap_s_max"] for run in runs)
    cells = [f"{count:.1f}", f"{each_ms:.0f} ms", f"{1e3 * longest:.0f} ms"]
    for middleware in middlewares:
        chosen = [run for run in runs if run["middleware"] == middleware]
        lost = np.mean([sum(value or 0 for key, value in run.items()
                            if key.startswith("packets_lost_")) for run in chosen])
        cells += [f"{lost:.1f}", f"{mean('map_age_s', chosen):.2f} s"]
    return f"| {name} | " + " | ".join(cells) + " |"


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    ways, middlewares = (dict.fromkeys(run[name] for run in runs)
                         for name in ("roaming", "middleware"))
    print("| roaming | handovers | gap, mean | longest | " + " | ".join(
        f"packets lost, `{name}` | map age" for name in middlewares) + " |")
    print("|---" * (4 + 2 * len(middlewares)) + "|")
    for way in ways:
        print(row(way, [run for run in runs if run["roaming"] == way], middlewares))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
