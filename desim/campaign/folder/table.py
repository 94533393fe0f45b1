"""``runs.parquet``: one row a run, with its parameters and its metrics.

It holds results only, no times: the same design gives the same file, on whatever machine and
however often it was interrupted. Its metadata say which metrics raised, and of which reference
design it is.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from desim.campaign.design.columns import DESIM, FIXED, labelled
from desim.campaign.design.metrics import Metrics
from desim.campaign.design.plan import Plan, Vector
from desim.errors import InputError, printable
from desim.files import replacing
from desim.results.identity import versions
from desim.results.parquet import opened, read_table
from desim.results.row import Row, Rows
from desim.results.run import readable
from desim.results.status import RunStatus
from desim.results.tables import conform, full, words_or_numbers

# Of the metadata.
RAISED = "desim.raised"  # by metric, in how many runs, and the first error
REFERENCE = "desim.reference"  # a ``ReferenceDesign``


def write_table(path: Path, plan: Plan, metrics: Metrics, rows: Rows,
                runs: list[tuple[Vector, int, str]]) -> None:
    """Write the table of the runs that are done, by vector and iteration."""
    made = sorted(((vector, iteration, run_id) for vector, iteration, run_id in runs
                   if run_id in rows), key=lambda run: (run[0].number, run[1]))
    columns: dict[str, list[object]] = {
        "run_id": [run_id for _, _, run_id in made],
        "vector": [vector.number for vector, _, _ in made],
        "iteration": [iteration for _, iteration, _ in made],
        "seed": [plan.seed(vector, iteration) for vector, iteration, _ in made],
        **{name: [rows[run_id].get(name) for _, _, run_id in made]
           for name in ("status", "error", "digest")},
        DESIM: [f"{versions()['desim']} {vector.source}" for vector, _, _ in made],
        **{column: [of[vector.levels[name].label] for vector, _, _ in made]
           for name in plan.parameters for column, of in labelled(plan, name).items()}}
    found = [metrics.of(rows[run_id]) if rows[run_id]["status"] == RunStatus.FINISHED else {}
             for _, _, run_id in made]
    names = dict.fromkeys((*metrics.names, *sorted(
        {name for values in found for name in values} - {*metrics.names})))
    columns |= {name: [values.get(name) for values in found] for name in names}
    table = pa.table({name: _column(values, pa.string() if name in FIXED else pa.float64())
                      for name, values in columns.items()})
    finished = {run_id: rows[run_id] for _, _, run_id in made}.values()
    metadata = {RAISED: json.dumps(raised(metrics, finished))}
    if plan.reference is not None:
        metadata[REFERENCE] = json.dumps(plan.reference._asdict())
    table = table.replace_schema_metadata(metadata)
    with replacing(path) as beside:
        pq.write_table(table, beside, compression="zstd")


_TEXT, _INT = pa.string(), pa.int64()
_OURS = full(pa.schema([("run_id", _TEXT), ("vector", _INT), ("iteration", _INT), ("seed", _INT),
                        ("status", _TEXT), ("error", _TEXT), ("digest", _TEXT)]),
             "error", "digest")


_OLD = {"gives_in_first": "saturated_first"}  # columns before 0.6, read until 0.7


def fields(path: Path) -> dict[str, pa.Field]:
    """The columns as the file has them, by their present names; no values are read. Raises
    ``InputError`` where the file is no table of a campaign."""
    with readable(path), opened(path) as file:
        found = {_OLD.get(field.name, field.name): field for field in file.schema_arrow}
    missing = [name for name in _OURS.names if name not in found]
    if missing:
        raise InputError(f"{path}: not the table of a campaign: it has no {missing[0]}")
    return found


def read(path: Path, columns: Sequence[pa.Field] | None = None) -> pa.Table:
    """The table that somebody else may have made, or these ``columns`` (``fields``) of it. Raises
    ``InputError`` where it is none of a campaign, or has other values than texts and numbers."""
    stored = fields(path).values() if columns is None else columns
    with readable(path):
        table = read_table(path, [field.name for field in stored])
        metadata, names = table.schema.metadata, [_OLD.get(name, name)
                                                  for name in table.column_names]
        table = table.rename_columns(names)
        known = conform(table, pa.schema([field for field in _OURS if field.name in names]))
        if columns is None and known.group_by(["vector", "iteration"]).aggregate(
                []).num_rows < len(known):
            raise InputError(f"{path}: not the table of a campaign: a vector has an iteration "
                             "twice")
        found = [known[name] if name in known.column_names else words_or_numbers(name, table[name])
                 for name in names]
    return pa.table(found, names, metadata=metadata)


def raised(metrics: Metrics, rows: Iterable[Row]) -> dict[str, tuple[int, str]]:
    """The metrics whose function raised, by name: in how many runs, and the first error."""
    found: dict[str, tuple[int, str]] = {}
    for row in rows:
        for name, error in metrics.raised(row).items():
            runs, first = found.get(name, (0, error))
            found[name] = runs + 1, first
    return found


def _column(values: list[object], empty: pa.DataType) -> pa.Array:
    """A column of the table. Whole numbers stay whole; mixed with others they become floats. Texts
    of plug-ins lose what a terminal would take for commands.
    ``empty`` is the type of a column without a value."""
    kinds = {type(value) for value in values if value is not None}
    if kinds == {int, float}:
        values = [float(value) if isinstance(value, int) else value for value in values]
    values = [printable(value) if isinstance(value, str) else value for value in values]
    return pa.array(values, None if kinds else empty)
