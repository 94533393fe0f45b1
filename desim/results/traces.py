"""Traces of runs, kept or made again, and the first row in which two of them differ."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
import pyarrow as pa

from desim import plugins
from desim.engine.trace import ROW, Names
from desim.errors import InputError
from desim.results import identity
from desim.results.file_names import SCENARIO, TRACE
from desim.results.parquet import opened
from desim.results.run import Run, readable
from desim.results.seal import Json
from desim.results.status import RunStatus, refuse_imported
from desim.results.tables import TRACE_ROWS, conform
from desim.scenario.load import load
from desim.scenario.schema.scenario import Scenario
from desim.simulation.simulation import Simulation

CONTEXT = 5  # rows shown on either side of a difference
_CHUNK = 1 << 18


class Rows(NamedTuple):
    """A whole trace: ``rows`` of dtype ``trace.ROW``, and the names of its ids."""

    rows: np.ndarray
    names: dict[int, str]


class Spool:
    """A trace sink into a file; ``rows`` maps what was written back into memory."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file = path.open("wb")

    def add(self, rows: np.ndarray) -> None:
        self._file.write(rows.tobytes())

    def rows(self) -> np.ndarray:
        """All rows; nothing can be added any more."""
        self._file.close()
        return np.memmap(self._path, ROW, "r") if self._path.stat().st_size else np.empty(0, ROW)


@contextmanager
def spools() -> Iterator[Path]:
    """A folder for spools, gone afterwards."""
    with TemporaryDirectory(prefix="desim-") as folder:
        yield Path(folder)


def simulated(scenario: Scenario, spool: Path, until_ns: int | None = None) -> Rows:
    """Run ``scenario`` (to ``until_ns``) and keep every row in the file ``spool``."""
    sink = Spool(spool)
    simulation = Simulation(scenario, trace_sink=sink.add)
    simulation.run(until_ns)
    return Rows(sink.rows(), simulation.names.items())


def kept(run: Run, spool: Path) -> Rows | None:
    """The trace that a run has kept; None where it has kept none."""
    if not run.keeps(TRACE):
        return None
    names, sink = Names(), Spool(spool)
    for table in _parts(run.file(TRACE)):
        rows = np.empty(len(table), ROW)
        for name in ("t_ns", "a", "b", "c"):
            rows[name] = table[name].to_numpy()
        for name in ("kind", "entity"):
            words = table[name].combine_chunks().dictionary_encode()
            ids = np.array([names.id(word) for word in words.dictionary.to_pylist()], "<u4")
            rows[name] = ids[words.indices.to_numpy()]
        sink.add(rows)
    return Rows(sink.rows(), run.names | names.items())


def _parts(path: Path) -> Iterator[pa.Table]:
    with readable(path), opened(path) as file:
        for batch in file.iter_batches():
            yield conform(pa.Table.from_batches([batch]), TRACE_ROWS)


def refuse_failed(run: Run) -> None:
    """Raise ``InputError`` for a run that failed: it has no end."""
    if run.manifest["status"] == RunStatus.FAILED:
        raise InputError(f"{run.path}: the run failed, it has no digest and no end to compare or "
                         "repeat; its manifest.json has the error")


def trace_of(run: Run, spool: Path, until_ns: int | None = None) -> Rows:
    """The trace of a run: the kept one, or that of running its scenario again. Raises
    ``InputError`` where it was not kept and other versions are installed now, and for the whole
    of a run that failed."""
    if until_ns is None:
        refuse_failed(run)
    rows = kept(run, spool)
    if rows is not None:
        return rows
    return simulated(repeatable(run, "trace rows", "trace.keep=all"), spool, until_ns)


def repeatable(run: Run, missing: str, setting: str = "") -> Scenario:
    """The scenario of a run that is to be repeated because it has not kept ``missing``, as it does
    with ``setting`` (empty: never). Raises ``InputError`` where other versions are
    installed now, and for what was imported."""
    refuse_imported(run.path, run.manifest, missing)
    if "loop" in run.manifest:
        raise InputError(f"{run.path}: its {missing} were not kept, and real programs took part in "
                         "it: only desim loop repeats it"
                         f"{setting and f' (with --set {setting} they are kept)'}")
    _refuse_other(run, missing, setting, {"versions": identity.versions()})
    with nullcontext() if run.trust else plugins.installed_only():
        scenario = load(run.file(SCENARIO)).scenario
        modules = identity.modules(scenario)
        now = {"plugins": identity.plugin_references(scenario), "source": identity.source(modules)}
    _refuse_other(run, missing, setting, now)
    return scenario


def _refuse_other(run: Run, missing: str, setting: str, now: Json) -> None:
    other = [name for name, value in now.items() if run.manifest.get(name) != value]
    if other:
        raise InputError(f"{run.path}: its {missing} were not kept, and it cannot be repeated: "
                         f"{', '.join(other)} in its manifest differ from those installed now; "
                         "run the scenario again"
                         f"{setting and f' (with --set {setting} they are kept)'}")


def first_difference(first: np.ndarray, second: np.ndarray) -> int | None:
    """The number of the first row in which two traces differ; where one ends, if it is the
    beginning of the other; None if they are equal. The order of rows inside an instant does not
    count."""
    shorter, begin = min(len(first), len(second)), 0
    while begin < shorter:
        end = min(begin + _CHUNK, shorter)
        unequal = np.asarray(first[begin:end] != second[begin:end])
        if not unequal.any():
            begin = end
            continue
        at = begin + int(np.argmax(unequal))
        one, other = _instant(first, at), _instant(second, at)
        if one != other or (np.sort(first[one]) != np.sort(second[other])).any():
            return at
        begin = one.stop
    return None if len(first) == len(second) else shorter


def _instant(rows: np.ndarray, at: int) -> slice:
    """The rows of the instant of row ``at``, as far as they are near it."""
    begin = max(at - _CHUNK, 0)
    times = rows["t_ns"][begin:at + _CHUNK]
    first, end = np.searchsorted(times, times[at - begin]), np.searchsorted(
        times, times[at - begin], side="right")
    return slice(begin + int(first), begin + int(end))
