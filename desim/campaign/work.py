"""One run of a campaign, and the row that remains of it.

A run that fails is a result: its row says why.
"""

from __future__ import annotations

import gc
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from desim import api, plugins
from desim.blame import blame
from desim.errors import InputError, told
from desim.experiment.results import FAILED, FINISHED
from desim.experiment.seal import likeness
from desim.scenario.load import Loaded

Row = dict[str, Any]
# Costs differ from machine to machine; they are not results.
_COSTS = ("simulated_s", "wall_s", "cpu_s", "peak_memory_mb", "events")
_NOT_NUMBERS = ("robots", "latency_by_topic", "digest")


class Task(NamedTuple):
    """A run to be done: ``functions`` are metrics that look at the run's folder."""

    run_id: str
    loaded: Loaded
    out: str
    functions: tuple[str, ...]


class Unwritable(InputError):
    """The results cannot be written: no run of the campaign would fare better."""


class Changed(InputError):
    """What is run is not what was planned any more."""


def work(task: Task) -> Row:
    """Run it. Raises ``Unwritable`` where results cannot be written, and ``Changed``."""
    try:
        run = api.run(task.loaded, out=task.out, command="desim sweep")
    except InputError as error:
        if isinstance(error.__cause__, OSError):
            raise Unwritable(*error.args) from error
        return failure(task.run_id, "; ".join(map(str, error.args)))
    except Exception as error:  # whatever a model or a plug-in does
        return failure(task.run_id, blame(error).line)
    finally:
        gc.collect()  # a run's arrays hang in circles
    if run.manifest["run_id"] != task.run_id:
        raise Changed("the source of desim, of a plug-in or a file of the scenario has changed "
                      "since the campaign began, so that its runs would be others; the same "
                      "command begins anew with what there is now")
    return row_of(run, task.functions)


def failure(run_id: str, error: str) -> Row:
    """The row of a run that came to nothing."""
    return {"run_id": run_id, "status": FAILED, "error": error}


def row_of(run: api.Run, functions: tuple[str, ...]) -> Row:
    """The row of a run's folder; ``folder`` tells whether that has changed since. Raises
    ``InputError`` where it is damaged."""
    manifest = run.manifest
    try:
        folder = likeness(run.path)
    except OSError as error:
        raise InputError(f"{run.path}: damaged: {error}") from error
    if manifest["status"] != FINISHED:
        return {**failure(manifest["run_id"], str(manifest.get("error") or manifest["status"])),
                "folder": folder}
    values, raised = _evaluated(functions, run)
    row = {"run_id": manifest["run_id"], "status": FINISHED, "folder": folder,
           "digest": manifest["digest"],
           "cost": {name: manifest[name] for name in _COSTS},
           "metrics": flat(run.metrics), "functions": values}
    return {**row, "raised": raised} if raised else row


def flat(summary: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """The numbers and words of a summary by one name each: ``traffic_simulation_bytes``. What is
    told robot by robot or topic by topic stays in the run's folder."""
    out: dict[str, Any] = {}
    for name, value in summary.items():
        if not prefix and name in _NOT_NUMBERS:
            continue
        if isinstance(value, Mapping):
            out |= flat(value, f"{prefix}{name}_")
        elif not isinstance(value, list):
            out[f"{prefix}{name}"] = value
    return out


def _evaluated(functions: tuple[str, ...], run: api.Run,
               ) -> tuple[dict[str, float | None], dict[str, str]]:
    """The metrics that are functions of a run: None where one says so, is not finite, or raises;
    and the errors of those that raised."""
    values: dict[str, float | None] = {}
    raised = {}
    for name in functions:
        try:
            value = plugins.imported("function", name)(run)
            values[name] = None if value is None or not math.isfinite(value) else float(value)
        except (Exception, SystemExit) as error:  # the run is finished, and stays so
            values[name], raised[name] = None, told(error)
    return values, raised


def folder_of(out: Path, name: str, run_id: str) -> Path:
    """Where the run's results are."""
    return out / name / run_id
