"""The folder of a run, read again."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from desim.errors import InputError, first_line
from desim.files import content_below
from desim.results import maps, tables
from desim.results.file_names import MANIFEST, MAPS, NAMES, SCENARIO, SUMMARY
from desim.results.frames import data_frame
from desim.results.seal import MOST_BYTES, Json, manifest_of, parsed, wrong_with
from desim.results.shown import InNotebooks
from desim.scenario import yaml12
from desim.scenario.complaints import lines, validated
from desim.scenario.schema.environment import MapFile
from desim.scenario.schema.scenario import Scenario

if TYPE_CHECKING:
    import pandas


class Run(InNotebooks):
    """A run's folder: everything is read when it is asked for. Somebody else may have made it: its
    files are data. ``trust``: where it is made again, code that its scenario names may run that is
    no installed plug-in."""

    def __init__(self, path: str | Path, trust: bool = False) -> None:
        self.path, self.trust = Path(path), trust
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
        with self._readable(SCENARIO) as text:
            data, places = yaml12.parse(text.decode(), str(self.path / SCENARIO))
            found = validated(Scenario, data)
        if isinstance(found, list):
            raise InputError(*lines(found, places))
        environment = found.environment
        terrain = environment.terrain
        if not isinstance(terrain, MapFile):
            return found
        placed = {"map": os.path.abspath(self.path / terrain.map)}  # it is relative to the run
        return found.model_copy(update={"environment": environment.model_copy(update={
            "terrain": terrain.model_copy(update=placed)})})

    @cached_property
    def metrics(self) -> Json:
        """The summary."""
        with self._readable(SUMMARY) as text:
            return parsed(text)

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
        with self._readable(NAMES) as text:
            return {int(id_): str(name) for id_, name in parsed(text).items()}

    def table(self, name: str, names: Sequence[str] | None = None) -> dict[str, np.ndarray]:
        """``samples``, ``robots``, ``latency``, ``messages`` or ``trace`` by column (``names``:
        these only). A missing value is None among words and NaN among numbers."""
        with readable(self.file(f"{name}.parquet")) as file:
            return arrays(tables.read(file, names))

    def to_pandas(self, table: str = "samples") -> pandas.DataFrame:
        """A ``table`` as a data frame. Raises ``InputError`` where pandas is not installed."""
        return data_frame(self.table(table))

    def has(self, name: str) -> bool:
        """Whether the run has left this file. If it has gone since, ``file`` says so: a missing
        table is no empty one."""
        return name in self.manifest["files"]

    def keeps(self, name: str) -> bool:
        """Whether the run has left this file, and it is still there; else what it has can be made
        again from the scenario."""
        return self.has(name) and os.path.lexists(self.path / name)

    def file(self, name: str) -> Path:
        """One of its files, as desim wrote it. Raises ``InputError`` where it is not so.

        One that changes it after this look could as well change it while it is read: the digest
        shows damage, no origin. So readers open it anew, without following a link, and check
        what they find."""
        if name not in self.manifest["files"]:
            raise InputError(f"{self.path}: has no {name} (its status is "
                             f"{self.manifest['status']!r})")
        wrong = wrong_with(self.path, self.manifest, name)
        if wrong is not None:
            raise InputError(f"{self.path}: damaged: {wrong}; running its scenario again mends it")
        return self.path / name

    def content(self, name: str) -> bytes:
        """The content of one of its files, as desim wrote it. Raises ``InputError``."""
        self.file(name)
        with readable(self.path / name):
            return content_below(self.path, name, MOST_BYTES)

    @contextmanager
    def _readable(self, name: str) -> Iterator[bytes]:
        text = self.content(name)
        with readable(self.path / name):
            yield text

    def _map(self, name: str) -> maps.OccupancyMap:
        about, image = (self.content(f"{MAPS}/{name}.{ending}") for ending in ("yaml", "pgm"))
        with readable(self.path / MAPS / f"{name}.pgm"):
            return maps.parsed(about, image)

    def __repr__(self) -> str:
        return f"Run({str(self.path)!r})"


def _no_run(path: Path) -> str:
    if os.path.lexists(path / MANIFEST):
        return (f"{path}: damaged: {MANIFEST} is not what desim writes, or what an earlier version "
                "wrote; running its scenario again mends it")
    if path.is_file():
        return (f"{path}: a file, not the folder of a run; of a scenario: desim run FILE, or desim "
                "net fleet FILE without its robots")
    cut_off = " (it is being written, or was cut off)" if path.suffix == ".partial" else ""
    return (f"{path}: not the folder of a run{cut_off}; a run's folder has a {MANIFEST}, e.g. "
            "results/hello/1a2b3c4d5e6f")


# What reading raises where a seal is right and the content is not: JSON's, pydantic's, Arrow's, and
# what is missing, of another type, or out of range.
_DAMAGE = (ValueError, OSError, RecursionError, pa.ArrowException, LookupError, TypeError,
           AttributeError, ArithmeticError)


@contextmanager
def readable(file: Path) -> Iterator[Path]:
    """Turn errors of reading the file into an ``InputError`` that says it is damaged."""
    try:
        yield file
    except _DAMAGE as error:
        raise InputError(f"{file}: damaged: {first_line(error)}") from error


def arrays(table: pa.Table) -> dict[str, np.ndarray]:
    """The columns of a table."""
    return {column: _array(table[column]) for column in table.column_names}


def _array(column: pa.ChunkedArray) -> np.ndarray:
    if not pa.types.is_dictionary(column.type):
        return column.to_numpy()
    # pyarrow's own to_numpy() reads a null as the dictionary's first word.
    parts = [np.array([*chunk.dictionary.to_pylist(), None], object)[
        chunk.indices.fill_null(-1).to_numpy(zero_copy_only=False)] for chunk in column.chunks]
    return np.concatenate([np.empty(0, object), *parts])
