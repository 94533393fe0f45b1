"""The tables of a run's folder, with the columns that desim writes: anybody may have made one."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pyarrow as pa

from desim.results import recording_tables
from desim.results.file_names import EVENTS, LINKS, MESSAGES, POSES, ROBOTS, SAMPLES, TRACE
from desim.results.parquet import EVENT_SCHEMA, MESSAGE_SCHEMA, TRACE_SCHEMA, read_table

_LATER = ("texts", "explored_union", "words")  # not in the tables of earlier versions
_WORDS = ("cause",)  # beside numbers


def full(schema: pa.Schema, *may_miss: str) -> pa.Schema:
    """The schema of a table in which only these columns may miss values."""
    return pa.schema([field.with_nullable(field.name in may_miss) for field in schema])


TRACE_ROWS = full(TRACE_SCHEMA)
_NO_TIMES = np.empty(0, np.int64)
_SECONDS = pa.schema([("time_s", pa.float64())])
_PLACED = pa.schema([*_SECONDS, ("robot", pa.string()), *(
    (name, pa.float64()) for name in ("x_m", "y_m", "yaw_rad", "explored", "explored_union"))])
_WITH_OTHERS = (SAMPLES, ROBOTS)  # columns of numbers, by what the run measured


@cache
def _schemas() -> dict[str, pa.Schema]:
    """The columns of each table. They are made when a table is read: pyarrow imports pandas, where
    it is installed, with the first array."""
    return {
        MESSAGES: full(MESSAGE_SCHEMA, "first_ns", "last_ns", "reason", "latency_ns"),
        TRACE: TRACE_ROWS, EVENTS: full(EVENT_SCHEMA, "words"),
        LINKS: full(pa.schema([("time_s", pa.float64()), ("host", pa.string()),
                               ("other", pa.string()), ("linked", pa.bool_())])),
        "latency.parquet": full(pa.schema([
            ("topic", pa.string()), *(
                (name, pa.int64()) for name in ("from_ns", "to_ns", "count"))]), "to_ns"),
        POSES: full(recording_tables.poses_table(_NO_TIMES, (), np.empty((0, 0, 3))).schema),
        "moving_obstacles.parquet": full(
            recording_tables.obstacles_table(_NO_TIMES, np.empty((0, 0, 3))).schema),
        "growth.parquet": full(recording_tables.growth_table(()).schema),
        "plans.parquet": full(recording_tables.plans_table(()).schema, "texts"),
        "walls.parquet": full(recording_tables.walls_table(()).schema),
        SAMPLES: full(_SECONDS), ROBOTS: full(_PLACED, "explored", "explored_union")}


def read(path: Path, columns: Sequence[str] | None = None) -> pa.Table:
    """A table of a run (these ``columns`` of it). Raises as ``read_table`` does, also where a
    column is missing, or has values that desim does not write there."""
    table, schema = read_table(path, columns), _schemas()[path.name]
    known = conform(table, schema if columns is None else pa.schema(
        [field for field in schema if field.name in columns]))
    if path.name in _WITH_OTHERS:
        for name in table.column_names:
            if name not in known.column_names:
                known = known.append_column(name, (
                    words_or_numbers if name in _WORDS else numbers)(name, table[name]))
    return known


def conform(table: pa.Table, schema: pa.Schema) -> pa.Table:
    """The columns of ``schema`` in a table, as it has them. Raises ``ValueError`` and
    ``pa.ArrowException``."""
    if len(set(table.column_names)) < table.num_columns:
        raise ValueError("it has two columns of one name")
    missing = [name for name in schema.names if name not in (*table.column_names, *_LATER)]
    if missing:
        raise ValueError(f"it has no column {missing[0]}")
    there = pa.schema([field for field in schema if field.name in table.column_names])
    return table.select(there.names).cast(there)


def words_or_numbers(name: str, column: pa.ChunkedArray) -> pa.ChunkedArray:
    """The column, if it has texts or numbers. Raises ``ValueError``."""
    return column if pa.types.is_string(column.type) else numbers(name, column)


def numbers(name: str, column: pa.ChunkedArray) -> pa.ChunkedArray:
    """The column, if it has numbers. Raises ``ValueError``."""
    kind = column.type
    if not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind)
            or pa.types.is_null(kind)):
        raise ValueError(f"its column {name} has no numbers")
    return column
