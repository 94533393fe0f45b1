"""The folder of a run, read again."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from desim.errors import InputError
from desim.results import maps
from desim.results.file_names import MANIFEST, NAMES, SCENARIO, SUMMARY
from desim.results.seal import MAPS, Json, manifest_of, wrong_with
from desim.results.shown import InNotebooks
from desim.scenario import yaml12
from desim.scenario.schema.scenario import Scenario


class Run(InNotebooks):
    """A run's folder: everything is read when it is asked for."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        found = manifest_of(self.path)
        if found is None:
            raise InputError(_no_run(self.path))
        # How it ran: status, digest, versions, times.
        self.manifest: Json = found

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario of the run, every value spelled out. It is not checked again: its plug-ins
        and its map need not be there any more. ``params`` of a plug-in that is not there raises
        ``InputError``."""
        with readable(self.file(SCENARIO)) as file:
            return Scenario.model_validate(yaml12.read(str(file))[0])

    @cached_property
    def metrics(self) -> Json:
        """The summary."""
        with readable(self.file(SUMMARY)) as file:
            return json.loads(file.read_text())

    @cached_property
    def samples(self) -> dict[str, np.ndarray]:
        """The monitor's time series, by column; NaN where a number was not due
        (``measure.periods``)."""
        return self.table("samples")

    @cached_property
    def robots(self) -> dict[str, np.ndarray]:
        """The robots' places, once a second (``measure.periods.robots``), by column."""
        return self.table("robots")

    @cached_property
    def ledger(self) -> pa.Table:
        """The parts of each message's time, kept or made by running the scenario again
        (docs/why.md; ``desim.results.ledger.SCHEMA``)."""
        from desim.results.ledger import ledger_of  # which needs a Simulation

        return ledger_of(self)

    @cached_property
    def map(self) -> maps.OccupancyMap:
        """The last map of the robot that the metrics are about."""
        return self._map("merged")

    @cached_property
    def truth(self) -> maps.OccupancyMap:
        """The ground truth; what no laser can reach is unknown."""
        return self._map("truth")

    @cached_property
    def names(self) -> dict[int, str]:
        """The names of the ids in ``trace.parquet``."""
        with readable(self.file(NAMES)) as file:
            return {int(id_): name for id_, name in json.loads(file.read_text()).items()}

    def table(self, name: str) -> dict[str, np.ndarray]:
        """``samples``, ``robots``, ``latency``, ``messages`` or ``trace`` by column. A missing
        value is None among words and NaN among numbers."""
        return columns(self.file(f"{name}.parquet"))

    def has(self, name: str) -> bool:
        """Whether the run has left this file. If it has gone since, ``file`` says so: a missing
        table is no empty one."""
        return name in self.manifest["files"]

    def keeps(self, name: str) -> bool:
        """Whether the run has left this file, and it is still there; else what it has can be made
        again from the scenario."""
        return self.has(name) and (self.path / name).exists()

    def file(self, name: str) -> Path:
        """One of its files, as desim wrote it. Raises ``InputError`` where it is not so."""
        if name not in self.manifest["files"]:
            raise InputError(f"{self.path}: has no {name} (its status is "
                             f"{self.manifest['status']!r})")
        wrong = wrong_with(self.path, self.manifest, name)
        if wrong is not None:
            raise InputError(f"{self.path}: damaged: {wrong}; running its scenario again mends it")
        return self.path / name

    def _map(self, name: str) -> maps.OccupancyMap:
        for ending in ("pgm", "yaml"):
            self.file(f"{MAPS}/{name}.{ending}")
        return maps.load(self.path / MAPS, name)

    def __repr__(self) -> str:
        return f"Run({str(self.path)!r})"


def _no_run(path: Path) -> str:
    if os.path.lexists(path / MANIFEST):
        return (f"{path}: damaged: {MANIFEST} is not what desim writes, or what an earlier version "
                "wrote; running its scenario again mends it")
    cut_off = " (it is being written, or was cut off)" if path.suffix == ".partial" else ""
    return (f"{path}: not the folder of a run{cut_off}; a run's folder has a {MANIFEST}, e.g. "
            "results/hello/1a2b3c4d5e6f")


@contextmanager
def readable(file: Path) -> Iterator[Path]:
    """Turn errors of reading the file into an ``InputError`` that says it is damaged."""
    try:
        yield file
    except (ValueError, OSError, RecursionError, pa.ArrowException) as error:  # JSON's, pydantic's
        raise InputError(f"{file}: damaged: {str(error).splitlines()[0]}") from error


def columns(file: Path) -> dict[str, np.ndarray]:
    with readable(file):
        table = pq.read_table(file)
    return {column: _array(table[column]) for column in table.column_names}


def _array(column: pa.ChunkedArray) -> np.ndarray:
    if not pa.types.is_dictionary(column.type):
        return column.to_numpy()
    # pyarrow's own to_numpy() reads a null as the dictionary's first word.
    parts = [np.array([*chunk.dictionary.to_pylist(), None], object)[
        chunk.indices.fill_null(-1).to_numpy(zero_copy_only=False)] for chunk in column.chunks]
    return np.concatenate([np.empty(0, object), *parts])
