"""Tables of the robots on one access point, from the campaign of access_point.yaml.

    python scenarios/studies/access_point_table.py results/access_point

Prints Markdown, for each radio a table: for each middleware (down) and number of robots (across)
the mean share of pairs that do not know each other at the end of the run, and the bytes of
discovery in MB; "all" where every pair knows each other in every run.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet


def cell(runs) -> str:
    """The share that is unknown at the end, and the bytes of discovery."""
    unknown = np.mean([run["registry_divergence_end"] for run in runs])
    sent_mb = np.mean([run["discovery_bytes"] for run in runs]) / 1e6
    known = "all" if unknown == 0 else f"**{100 * unknown:.0f} % unknown**"
    return f"{known}, {sent_mb:.{0 if sent_mb >= 10 else 2}f} MB"


def main(campaign: Path) -> None:
    runs = parquet.read_table(campaign / "runs.parquet").to_pylist()
    radios, middlewares, robots = (list(dict.fromkeys(run[name] for run in runs))
                                   for name in ("radio", "middleware", "robots"))
    for radio in radios:
        print(f"| {radio} | " + " | ".join(map(str, robots)) + " |")
        print("|---" * (1 + len(robots)) + "|")
        for middleware in middlewares:
            print(f"| `{middleware}` | " + " | ".join(
                cell([run for run in runs if (run["radio"], run["middleware"], run["robots"]) == (
                    radio, middleware, count)]) for count in robots) + " |")
        print()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
