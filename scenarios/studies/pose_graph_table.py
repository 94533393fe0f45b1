"""A table of pose_graph beside scan_matching, from the campaign of pose_graph.yaml.

    python scenarios/studies/pose_graph_table.py results/pose_graph
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet

TERRAINS = "maze", "cross", "loop", "zigzag"
KINDS = "scan_matching", "pose_graph"
EXCHANGE = "messages_by_topic_/localization/*_bytes"


def spread(values, form: str) -> str:
    """The mean, with the least and the greatest."""
    return f"{np.mean(values):{form}} ({min(values):{form}} to {max(values):{form}})"


def row(terrain: str, kind: str, runs) -> str:
    """The figures of one kind of localization in one terrain."""
    return " | ".join((
        f"| {terrain} | `{kind}`", str(len(runs)), spread([run["ate_m"] for run in runs], ".2f"),
        spread([run["stood_s"] for run in runs], ".0f"),
        spread([run["map_quality"] for run in runs], ".3f"),
        f"{np.mean([(run.get(EXCHANGE) or 0) / 1e6 for run in runs]):.0f} |"))


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    print("| terrain | localization | runs | `ate_m` | `stood_s` | quality | MB |")
    print("|---" * 7 + "|")
    for terrain in TERRAINS:
        for kind in KINDS:
            print(row(terrain, kind, [run for run in runs if run["terrain"] == terrain
                                      and run["localization"] == kind]))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
