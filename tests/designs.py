"""Designs on a scenario that runs in a few milliseconds, and rows of runs that nobody made."""

from collections.abc import Sequence
from pathlib import Path

from desim.campaign.design.design import LoadedDesign, load_design
from desim.campaign.design.plan import Plan
from desim.campaign.running.work import RunTask, work
from desim.results.row import Row

BASE = """\
name: small
environment: {terrain: {size: [12 m, 12 m], drawing: {cell: 4 m, lines: [
  "+--+--+--+", "|     |  |", "+  +  +  +", "|  |     |",
  "+  +--+  +", "|        |", "+--+--+--+"]}}}
fleet: {size: 2, start: {from: [-4 m, 4 m], step: [2 m, 0 m]}}
robot: {laser: {beams: 20}}
stop: {elapsed: 100 ms}
"""


def written(folder: Path, text: str, name: str = "design.yaml") -> Path:
    """The file of a design whose first lines, ``name`` and ``base``, are given."""
    (folder / "small.yaml").write_text(BASE)
    file = folder / name
    file.write_text(f"name: d\nbase: small.yaml\n{text}")
    return file


def loaded(folder: Path, text: str) -> LoadedDesign:
    return load_design(written(folder, text))


def planned(folder: Path, text: str) -> Plan:
    return Plan(loaded(folder, text))


def deployed(folder: Path, sizes: Sequence[int] = (1, 6, 3)) -> Path:
    """The file of a design of fleets of these sizes in the testbed, 2 to 5 runs of 100 s each."""
    file = folder / "design.yaml"
    file.write_text(f"""\
name: deployed
base: {Path(__file__).parents[1] / "scenarios" / "maze_8.yaml"}
set: {{stop.elapsed: 100 s}}
parameters:
  robots: {{key: fleet.size, values: {list(sizes)}}}
iterations: {{metric: exploration_time_s, width: 10 %, at_least: 2, at_most: 5}}
""")
    return file


def labels(plan: Plan) -> list[tuple[str, ...]]:
    """Of each vector."""
    return [tuple(level.label for level in vector.levels.values()) for vector in plan.vectors]


def row(run_id: str, **metrics: float) -> Row:
    """Of a finished run."""
    return {"run_id": run_id, "status": "finished", "folder": f"folder of {run_id}",
            "digest": f"digest of {run_id}", "cost": {}, "metrics": metrics, "functions": {}}


class Here:
    """Workers of this process: up to ``jobs`` tasks at once, finished in the order ``picked``."""

    def __init__(self, jobs=1, picked=lambda tasks: 0, work=work):
        self.jobs, self.picked, self.work = jobs, picked, work
        self.tasks: list[RunTask] = []
        self.begun: list[str] = []

    @property
    def has_idle_worker(self):
        return len(self.tasks) < self.jobs

    @property
    def is_busy(self):
        return bool(self.tasks)

    def begin(self, task):
        self.tasks.append(task)
        self.begun.append(task.run_id)

    def finished(self):
        task = self.tasks.pop(self.picked(self.tasks))
        return [(task, self.work(task))]
