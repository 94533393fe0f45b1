"""``desim.compare``: two runs, or two campaigns, side by side."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from desim.campaign.design.columns import FIXED
from desim.campaign.folder import table
from desim.campaign.folder.campaign import Campaign
from desim.campaign.folder.design_copy import DESIGN, kept_design
from desim.errors import InputError
from desim.results.comparison import ComparedRuns, KeyDifference, MetricPair, different_keys
from desim.results.run import Run
from desim.results.seal import Json
from desim.results.shown import InNotebooks
from desim.results.status import RunStatus
from desim.scenario import yaml12


def compare(first: str | Path | Run | Campaign, second: str | Path | Run | Campaign,
            ) -> ComparedRuns | ComparedCampaigns:
    """Two runs side by side, or two campaigns, by their folders or as they are. Raises
    ``InputError`` for a folder that is neither, and for one of each."""
    one, other = _opened(first), _opened(second)
    if isinstance(one, Run) and isinstance(other, Run):
        return ComparedRuns(one, other)
    if isinstance(one, Campaign) and isinstance(other, Campaign):
        return ComparedCampaigns(one, other)
    run, campaign = (one, other) if isinstance(one, Run) else (other, one)
    raise InputError(f"{run.path} is a run, {campaign.path} a campaign; wanted: two runs or two "
                     "campaigns")


def _opened(given: str | Path | Run | Campaign) -> Run | Campaign:
    if isinstance(given, Run | Campaign):
        return given
    return Campaign(given) if os.path.lexists(Path(given) / DESIGN) else Run(given)


class VectorPair(NamedTuple):
    """The means of two campaigns at the same levels of the parameters that both have. ``runs``:
    how many finished ones have the metric, of the first and of the second campaign."""

    levels: dict[str, object]
    metric: MetricPair
    runs: tuple[int, int]

    def json_object(self) -> Json:
        """The pair as an object for ``--json``."""
        return {"levels": self.levels, **self.metric.json_object(), "runs": list(self.runs)}


class ComparedCampaigns(InNotebooks):
    """Two campaigns side by side; everything is computed when it is asked for, from one column of
    their tables after the other."""

    def __init__(self, first: Campaign, second: Campaign) -> None:
        self.first, self.second = first, second

    @cached_property
    def _tables(self) -> tuple[_Columns, _Columns]:
        return _Columns(self.first), _Columns(self.second)

    @cached_property
    def _rows(self) -> list[dict[tuple[object, ...], np.ndarray]]:
        return [_by_levels(own, self.parameters) for own in self._tables]

    @cached_property
    def keys(self) -> list[KeyDifference]:
        """The keys of the designs that differ."""
        return different_keys(*(yaml12.read(str(kept_design(campaign.path)))[0]
                                for campaign in (self.first, self.second)))

    @cached_property
    def parameters(self) -> tuple[str, ...]:
        """The parameters that both have."""
        return tuple(name for name in self.first.design.parameters
                     if name in self.second.design.parameters
                     and all(name in own.fields for own in self._tables))

    @cached_property
    def reported(self) -> tuple[str, ...]:
        """The metrics that the first design's report shows first."""
        return tuple(name for name in self.first.design.report.metrics if name in self.metrics)

    @cached_property
    def metrics(self) -> tuple[str, ...]:
        """The metrics that are numbers in both tables."""
        one, other = self._tables
        apart = {*FIXED, *self.first.design.parameters, *self.second.design.parameters}
        return tuple(name for name in one.fields if name in other.fields and name not in apart
                     and one.has_numbers(name) and other.has_numbers(name))

    def pairs(self, metric: str) -> Iterator[VectorPair]:
        """The means of a metric over the finished runs, at each vector that both have."""
        numbers = [own[metric].to_numpy().astype(float) for own in self._tables]
        one, other = self._rows
        for levels, rows in one.items():
            if levels in other:
                values = [part[np.isfinite(part)] for part in (
                    numbers[0][rows], numbers[1][other[levels]])]
                means = [float(part.mean()) if part.size else None for part in values]
                yield VectorPair(dict(zip(self.parameters, levels, strict=True)),
                                 MetricPair(metric, *means), (values[0].size, values[1].size))

    def json_object(self) -> Json:
        """The comparison as an object for ``--json``."""
        return {"first": str(self.first.path), "second": str(self.second.path),
                "keys": [key._asdict() for key in self.keys],
                "metrics": [pair.json_object() for metric in self.metrics
                            for pair in self.pairs(metric)]}

    def __repr__(self) -> str:
        return f"ComparedCampaigns({str(self.first.path)!r}, {str(self.second.path)!r})"


class _Columns:
    """The columns of a campaign's table, each of which is read when it is asked for."""

    def __init__(self, campaign: Campaign) -> None:
        self._path = campaign.path / "runs.parquet"
        self.fields = table.fields(self._path)

    def __getitem__(self, name: str) -> pa.ChunkedArray:
        return table.read(self._path, [self.fields[name]])[name]

    def has_numbers(self, name: str) -> bool:
        """Whether a column has numbers, or truth values of all runs."""
        kind = self.fields[name].type
        return (pa.types.is_integer(kind) or pa.types.is_floating(kind)
                or pa.types.is_boolean(kind) and not self[name].null_count)


def _by_levels(columns: _Columns, parameters: tuple[str, ...],
               ) -> dict[tuple[object, ...], np.ndarray]:
    """The rows of the finished runs by the levels of these parameters, in order."""
    rows = np.flatnonzero(pc.equal(columns["status"], RunStatus.FINISHED.value))
    group = np.zeros(len(rows), np.int64)
    levels: list[tuple[object, ...]] = [()]
    for name in parameters:
        column = columns[name].combine_chunks().dictionary_encode()
        known = [*column.dictionary.to_pylist(), None]
        own = column.indices.fill_null(len(known) - 1).to_numpy()[rows]
        both, group = np.unique(group * len(known) + own, return_inverse=True)
        levels = [(*levels[code // len(known)], known[code % len(known)])
                  for code in both.tolist()]
    first = np.unique(group, return_index=True)[1]
    parts = np.split(rows[np.argsort(group, kind="stable")], np.cumsum(np.bincount(group))[:-1])
    return {levels[number]: parts[number] for number in np.argsort(first).tolist()}
