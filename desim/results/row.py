"""A run as one row of a table: its status, its costs, and its numbers by one name each."""

from __future__ import annotations

import math
from collections.abc import Mapping

from desim import plugins
from desim.errors import InputError, described
from desim.results.run import Run
from desim.results.seal import Json, likeness
from desim.results.status import RunStatus

Row = Json
Rows = dict[str, Row]  # by run id
# Costs differ from machine to machine; they are not results.
_COSTS = ("simulated_s", "wall_s", "cpu_s", "peak_memory_mb", "events")
_MOST_LETTERS = 10_000  # of an error
_NOT_NUMBERS = ("robots", "latency_by_topic", "digest")


def failure(run_id: str, error: str) -> Row:
    """The row of a run that failed. Of a long ``error`` it has the beginning."""
    if len(error) > _MOST_LETTERS:
        error = f"{error[:_MOST_LETTERS]}... ({len(error):,} letters)"
    return {"run_id": run_id, "status": RunStatus.FAILED.value, "error": error}


def row_of(run: Run, functions: tuple[str, ...]) -> Row:
    """The row of a run's folder. By its field ``folder`` a later change of the folder is noticed.
    Raises ``InputError`` where the folder is damaged."""
    manifest = run.manifest
    try:
        folder = likeness(run.path)
    except OSError as error:
        raise InputError(f"{run.path}: damaged: {error}") from error
    if manifest["status"] != RunStatus.FINISHED:
        return {**failure(manifest["run_id"], str(manifest.get("error") or manifest["status"])),
                "folder": folder}
    values, raised = _evaluated(functions, run)
    row = {"run_id": manifest["run_id"], "status": RunStatus.FINISHED.value, "folder": folder,
           "digest": manifest["digest"],
           "cost": {name: manifest[name] for name in _COSTS},
           "metrics": flat(run.metrics), "functions": values}
    return {**row, "raised": raised} if raised else row


def flat(summary: Mapping[str, object], prefix: str = "") -> Row:
    """The numbers and words of a summary by one name each: ``traffic_simulation_bytes``. Numbers by
    robot or by topic stay in the run's folder."""
    out: Row = {}
    for name, value in summary.items():
        if not prefix and name in _NOT_NUMBERS:
            continue
        if isinstance(value, Mapping):
            out |= flat(value, f"{prefix}{name}_")
        elif not isinstance(value, list):
            out[f"{prefix}{name}"] = value
    return out


def _evaluated(functions: tuple[str, ...], run: Run,
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
            values[name], raised[name] = None, described(error)
    return values, raised
