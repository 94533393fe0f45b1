"""How does desim cope with many runs? Makes a finished campaign without its runs.

    python tools/benchmarks/many_runs.py DESIGN OUT [--damaged]

One run of the design is real. All others get its manifest and summary, with other numbers in them,
in folders of their own, and a line in the index.
``--damaged`` leaves the index out.
"""

from __future__ import annotations

import argparse
import json
import random
import tempfile
from pathlib import Path

from desim import api
from desim.campaign.design.design import load_design
from desim.campaign.design.plan import Plan
from desim.campaign.folder.index import line_of
from desim.campaign.running.sweep import INDEX
from desim.results.file_names import SUMMARY
from desim.results.row import row_of
from desim.results.seal import likeness, seal


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("design", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--damaged", action="store_true")
    arguments = parser.parse_args()
    make(Plan(load_design(arguments.design)), arguments.out, not arguments.damaged)


def make(plan: Plan, out: Path, with_index: bool = True) -> int:
    """Make the folder of the plan's campaign; returns the number of its runs."""
    loaded, draw = plan.scenario(plan.vectors[0], 0), random.Random(1)
    with tempfile.TemporaryDirectory() as folder:
        run = api.run(loaded, out=folder)
        manifest, summary, row = run.manifest, run.metrics, row_of(run, ())
    runs = out / "runs" / loaded.scenario.name
    runs.mkdir(parents=True)
    count = 0
    with open(out / INDEX, "wb") as index:
        for iteration in range(plan.least_iterations):
            for vector in plan.vectors:
                run_id = plan.run_id(vector, iteration)
                other = {"exploration_time_s": draw.gauss(100.0, 10.0), "explored": draw.random()}
                folder = runs / run_id
                folder.mkdir()
                (folder / SUMMARY).write_text(json.dumps({**summary, **other}))
                seal(folder, {**manifest, "run_id": run_id}, [SUMMARY])
                if with_index:
                    index.write(line_of({**row, "run_id": run_id, "folder": likeness(folder),
                                         "metrics": {**row["metrics"], **other}}))
                count += 1
    return count


if __name__ == "__main__":
    main()
