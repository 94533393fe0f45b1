"""The tables of a run as CSV files."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
from pyarrow import csv as arrow_csv

from desim.errors import InputError
from desim.files import replacing, writing
from desim.results.file_names import SUMMARY, WRITTEN
from desim.results.parquet import opened
from desim.results.row import flat
from desim.results.run import Run, readable

_ENDING = ".parquet"
METRICS = "metrics.csv"


def write_csv(run: Run, folder: Path, done: Callable[[int, int], object]) -> list[Path]:
    """Write each table of ``run`` into ``folder``, as a CSV file with the table's name, and its
    metrics as ``metrics.csv``, a name and a value a line. A cell of a list has its values with
    spaces between them; what is missing is empty. ``done(rows, of_rows)`` is called as it goes on.

    Returns the files. Raises ``InputError`` for a run without tables, a damaged table, or a folder
    that cannot be written.
    """
    names = sorted(name.removesuffix(_ENDING) for name in WRITTEN
                   if name.endswith(_ENDING) and run.has(name))
    if not names:
        raise InputError(f"{run.path}: has no tables (its status is {run.manifest['status']!r})")
    count, total = 0, sum(_rows(run, name) for name in names)
    written = []
    for name in names:
        path = folder / f"{name}.csv"
        with writing(folder, "--csv"):
            folder.mkdir(parents=True, exist_ok=True)
            with replacing(path) as beside:
                for more in _write(run, name, beside):
                    count += more
                    done(count, total)
        written.append(path)
    if run.has(SUMMARY):
        path = folder / METRICS
        with writing(folder, "--csv"), replacing(path) as beside, \
                beside.open("w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows([("metric", "value"), *flat(run.metrics).items()])
        written.append(path)
    return written


def _rows(run: Run, name: str) -> int:
    with readable(run.file(f"{name}{_ENDING}")) as file, opened(file) as table:
        return table.metadata.num_rows


def _write(run: Run, name: str, path: Path) -> Iterator[int]:
    """Copy one table, batch by batch, for it may be larger than the memory; yields the number of
    rows of each."""
    with readable(run.path / f"{name}{_ENDING}") as source, opened(source) as table:
        schema = pa.schema([(field.name, _plain(field.type)) for field in table.schema_arrow])
        with arrow_csv.CSVWriter(path, schema) as writer:
            for batch in table.iter_batches():
                writer.write_batch(pa.record_batch(
                    [_column(column) for column in batch.columns], schema=schema))
                yield len(batch)


def _plain(kind: pa.DataType) -> pa.DataType:
    """The type of a column in CSV, which has neither dictionaries nor lists."""
    if pa.types.is_dictionary(kind):
        return kind.value_type
    return pa.string() if pa.types.is_list(kind) else kind


def _column(column: pa.Array) -> pa.Array:
    if pa.types.is_list(column.type):
        return pc.binary_join(column.cast(pa.list_(pa.string())), " ")
    return column.cast(_plain(column.type))
