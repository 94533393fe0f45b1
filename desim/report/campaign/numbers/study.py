"""The campaign that a report is about: its runs by vector, and its parameters as axes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from pydantic import TypeAdapter

from desim.campaign.design.columns import FIXED
from desim.campaign.design.design import Design, LatinHypercube, Saltelli, Sobol, led_by
from desim.campaign.design.quantities import SUFFIXES
from desim.campaign.design.reference import ReferenceDesign
from desim.campaign.folder.run_folders import run_folders
from desim.campaign.folder.table import RAISED, REFERENCE, read
from desim.errors import InputError, did_you_mean, printable
from desim.results.run import readable
from desim.results.seal import parsed
from desim.results.status import RunStatus

# Instants that a run may be stopped before: null is later than ``simulated_s``.
TIMES = ("exploration_time_s", "union_time_s", "fleet_time_s")
_COUNTED = ("messages_dropped_", "packets_lost_")
_LOG_FROM = 10.0  # largest over smallest value of an axis


class Axis(NamedTuple):
    """A parameter's levels: ascending, with their ``numbers`` in ``unit``; if they have no numbers,
    in the design's order."""

    name: str
    labels: tuple[str, ...]
    numbers: np.ndarray
    unit: str

    @property
    def is_numeric(self) -> bool:
        return len(self.numbers) > 0

    @property
    def log(self) -> bool:
        """Whether the levels are spaced by factors rather than by differences."""
        x = self.numbers
        if len(x) < 3 or x[0] <= 0 or x[-1] / x[0] < _LOG_FROM:
            return False
        steps, factors = np.diff(x), np.diff(np.log(x))
        return bool(factors.std() / factors.mean() < steps.std() / steps.mean())

    @property
    def title(self) -> str:
        """The name with its unit, for figures and tables."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    def label(self, vector: VectorRuns) -> str:
        """The level of a vector."""
        return self.labels[vector.levels[self.name]]

    def places(self, vectors: Sequence[VectorRuns]) -> np.ndarray:
        """The places of vectors [n] along the axis: numbers, or else the levels' indices."""
        at = np.array([vector.levels[self.name] for vector in vectors], int)
        return self.numbers[at] if self.is_numeric else at


class VectorRuns(NamedTuple):
    """The runs of one vector: ``rows`` of the table, in the order of iterations. ``levels`` are
    indices into each axis' labels."""

    number: int
    levels: dict[str, int]
    rows: np.ndarray


class Study:
    """The runs of the campaign in ``folder``. Raises ``InputError`` where there are none."""

    def __init__(self, folder: Path, design: Design) -> None:
        self.folder, file = folder, folder / "runs.parquet"
        if not file.is_file():
            raise InputError(f"{folder}: not a campaign's folder: there is no runs.parquet (desim "
                             "sweep DESIGN writes it when it ends)")
        self._file, self._table = file, read(file)
        if not self._table.num_rows:
            raise InputError(f"{folder}: no run has ended yet")
        self.design = led_by(design, self._tasks())
        found = {name: self._axis(name) for name in design.parameters}
        self.axes = {name: axis for name, (axis, _) in found.items()}
        taken = {*FIXED, *design.parameters,
                 *(name + suffix for name in design.parameters for suffix in SUFFIXES)}
        self.columns = frozenset(self._table.column_names)
        self.metrics = tuple(name for name in self._table.column_names
                             if name not in taken and self._is_number(name))
        self._refuse_unknown()
        self.failed = self.words("status") == RunStatus.FAILED
        self.iterations = self.numbers("iteration").astype(int)
        self.vectors = self._vectors({name: levels for name, (_, levels) in found.items()})
        self.column, self.text = cache(self._metric), cache(self.words)

    def numbers(self, name: str) -> np.ndarray:
        """A column [runs] of float64, the caller's own; NaN where a run has no value."""
        column = self._table[name]
        if pa.types.is_string(column.type):  # all of it is null
            return np.full(len(column), np.nan)
        return pc.cast(column, pa.float64(), safe=False).to_numpy().copy()  # Arrow's is read-only

    def _metric(self, name: str) -> np.ndarray:
        """A metric [runs]. Reasons of drops that a run does not list count 0."""
        column = self.numbers(name)
        if name.startswith(_COUNTED):
            column[np.isnan(column) & ~self.failed] = 0.0
        return column

    def words(self, name: str) -> np.ndarray:
        """A column [runs] of text that can be printed, or None."""
        return np.array([printable(text) if isinstance(text, str) else text
                         for text in self._table[name].to_pylist()], object)

    def has(self, name: str) -> bool:
        """Whether a run has a number of this metric."""
        return name in self.metrics and bool(np.isfinite(self.column(name)).any())

    @cached_property
    def run_folders(self) -> dict[str, Path]:
        """The folders of runs that are there, by run id."""
        return run_folders(self.folder)

    @cached_property
    def once(self) -> np.ndarray:
        """A mask [rows] in which a run that several vectors share, with a row each, counts once."""
        once = np.zeros(len(self.failed), bool)
        once[np.unique(self.text("run_id").astype(str), return_index=True)[1]] = True
        return once

    @cached_property
    def raised(self) -> dict[str, tuple[int, str]]:
        """The metrics whose function raised: in how many runs, and the first error."""
        with readable(self._file):
            return {name: (int(runs), str(error))
                    for name, (runs, error) in self._said(RAISED).items()}

    @property
    def reference(self) -> ReferenceDesign | None:
        """The reference design of which these are runs, None if of none."""
        with readable(self._file):
            said = self._said(REFERENCE)
            return TypeAdapter(ReferenceDesign).validate_python(said) if said else None

    @property
    def has_aim(self) -> bool:
        """Whether runs had an aim, which they could miss. Patrolling has none: it goes on until it
        is stopped."""
        return "censored" in self.metrics

    @cached_property
    def censored(self) -> np.ndarray:
        """A mask [runs]: runs that ended without having explored enough."""
        if not self.has_aim:
            return np.zeros(len(self.failed), bool)
        return self.column("censored") == 1.0

    @cached_property
    def timed_out(self) -> np.ndarray:
        """A mask [runs]: runs stopped by their time limit. Without recorded reasons all may be."""
        if "stop_reason" not in self._table.column_names:
            return np.ones(len(self.failed), bool)
        return self.text("stop_reason") == "elapsed"

    @property
    def reached(self) -> np.ndarray:
        """A mask [runs]: the successes, as the paper counts them."""
        return ~self.failed & ~self.censored

    @property
    def success(self) -> str:
        """The words for what the runs of ``reached`` did."""
        if not self.has_aim:
            return "finished"
        some_have_none = (~self.failed & np.isnan(self.column("censored"))).any()
        return "reached the aim or had none" if some_have_none else "reached the aim"

    @property
    def is_sampled(self) -> bool:
        """Whether vectors are points in a space, of which no two share a level."""
        return isinstance(self.design.vectors, (LatinHypercube, Sobol, Saltelli))

    @property
    def is_paired(self) -> bool:
        """Whether an iteration has the same seed in every vector."""
        return self.design.random_numbers == "common"

    @property
    def against(self) -> Axis | None:
        """The parameter along the axis: the design's, else the first one with numbers, else the
        first one."""
        named = self.design.report.against
        if named is not None:
            return self.axes[named]
        axes = self.axes.values()
        return next((axis for axis in axes if axis.is_numeric), next(iter(axes), None))

    @property
    def by(self) -> Axis | None:
        """The parameter that distinguishes lines."""
        named, against = self.design.report.by, self.against
        if named is not None:
            return self.axes[named]
        return next((axis for axis in self.axes.values() if axis is not against), None)

    @property
    def axis(self) -> Axis:
        """``against``, of a design with parameters. Raises ``ValueError`` without."""
        return _required(self.against)

    @property
    def setting(self) -> Axis:
        """``by``, of a design with two parameters. Raises ``ValueError`` without."""
        return _required(self.by)

    @property
    def others(self) -> list[Axis]:
        """The parameters that are neither along the axis nor distinguish lines."""
        return [axis for axis in self.axes.values()
                if axis is not self.against and axis is not self.by and len(axis.labels) > 1]

    def label(self, vector: VectorRuns, *axes: Axis) -> str:
        """A vector in words, ``bandwidth = 3 Mb/s, deployment = field``: all of its parameters
        unless some are named."""
        return ", ".join(f"{axis.name} = {axis.label(vector)}"
                         for axis in axes or self.axes.values())

    def _said(self, key: str) -> dict[str, Any]:
        """An entry of the table's metadata; empty where there is none."""
        return parsed((self._table.schema.metadata or {}).get(key.encode(), b"{}"))

    def _tasks(self) -> list[str]:
        """The tasks of the runs that have finished."""
        if "task" not in self._table.column_names:
            return ["exploration"]  # the table is older than other tasks
        return [task for task in dict.fromkeys(self._table["task"].to_pylist()) if task]

    def _is_number(self, name: str) -> bool:
        kind = self._table[name].type
        return name in TIMES or pa.types.is_integer(kind) or pa.types.is_floating(kind) \
            or pa.types.is_boolean(kind)

    def _axis(self, name: str) -> tuple[Axis, np.ndarray]:
        """The axis of a parameter, and the index [runs] of each run's level."""
        columns = self._table.column_names
        of_numbers = next((name + suffix for suffix in SUFFIXES if name + suffix in columns
                           and self._is_number(name + suffix)), None)
        if name not in columns and of_numbers is None:
            raise InputError(f"{self.folder}: the table has no parameter {name!r}; it belongs to "
                             "another design")
        if of_numbers is None:
            words = self.words(name).tolist()
            at = {label: i for i, label in enumerate(dict.fromkeys(words))}
            return Axis(name, tuple(at), np.zeros(0), ""), np.array([at[word] for word in words])
        numbers, which, levels = np.unique(self.numbers(of_numbers), return_index=True,
                                           return_inverse=True)
        labels = self.words(name)[which] if name in columns and not self._is_number(name) \
            else [f"{number:.12g}" for number in numbers]
        return Axis(name, tuple(labels), numbers, SUFFIXES[of_numbers.removeprefix(name)]), levels

    def _vectors(self, levels: dict[str, np.ndarray]) -> list[VectorRuns]:
        """The vectors, by the ``levels`` [runs] of each parameter."""
        numbers = self.numbers("vector").astype(int)
        order = np.lexsort((self.iterations, numbers))
        begins = np.flatnonzero(np.diff(numbers[order], prepend=-1))
        return [VectorRuns(int(numbers[rows[0]]),
                           {name: int(of[rows[0]]) for name, of in levels.items()}, rows)
                for rows in np.split(order, begins[1:])]

    def _refuse_unknown(self) -> None:
        for key in ("against", "by"):
            name = getattr(self.design.report, key)
            if name is not None and name not in self.axes:
                raise InputError(f"report.{key}: there is no parameter {name!r}"
                                 f"{did_you_mean(name, self.axes)}; allowed: "
                                 f"{', '.join(self.axes) or 'none'}")


def _required(axis: Axis | None) -> Axis:
    if axis is None:
        raise ValueError("the design has too few parameters")
    return axis
