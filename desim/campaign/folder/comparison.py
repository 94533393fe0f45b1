"""``desim.compare``: two runs, or two campaigns, side by side."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from desim.campaign.design.columns import FIXED
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
    """Two campaigns side by side; everything is computed when it is asked for."""

    def __init__(self, first: Campaign, second: Campaign) -> None:
        self.first, self.second = first, second

    @cached_property
    def keys(self) -> list[KeyDifference]:
        """The keys of the designs that differ."""
        return different_keys(*(yaml12.read(str(kept_design(campaign.path)))[0]
                                for campaign in (self.first, self.second)))

    @cached_property
    def parameters(self) -> tuple[str, ...]:
        """The parameters that both have."""
        tables = self.first.runs, self.second.runs
        return tuple(name for name in self.first.design.parameters
                     if name in self.second.design.parameters
                     and all(name in table for table in tables))

    @cached_property
    def reported(self) -> tuple[str, ...]:
        """The metrics that the first design's report shows first."""
        return tuple(name for name in self.first.design.report.metrics if name in self.metrics)

    @cached_property
    def metrics(self) -> tuple[str, ...]:
        """The metrics that are numbers in both tables."""
        one, other = self.first.runs, self.second.runs
        apart = {*FIXED, *self.first.design.parameters, *self.second.design.parameters}
        return tuple(name for name in one if name in other and name not in apart
                     and all(table[name].dtype.kind in "bif" for table in (one, other)))

    def pairs(self, metric: str) -> Iterator[VectorPair]:
        """The means of a metric over the finished runs, at each vector that both have."""
        one, other = (_by_levels(campaign, self.parameters) for campaign in
                      (self.first, self.second))
        for levels, rows in one.items():
            if levels in other:
                values = [_values(campaign, metric, own) for campaign, own in (
                    (self.first, rows), (self.second, other[levels]))]
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


def _by_levels(campaign: Campaign, parameters: tuple[str, ...],
               ) -> dict[tuple[object, ...], list[int]]:
    """The rows of the finished runs by the levels of these parameters."""
    table, found = campaign.runs, dict[tuple[object, ...], list[int]]()
    columns = [table[name].tolist() for name in parameters]
    for row in np.flatnonzero(table["status"] == RunStatus.FINISHED).tolist():
        found.setdefault(tuple(column[row] for column in columns), []).append(row)
    return found


def _values(campaign: Campaign, metric: str, rows: list[int]) -> np.ndarray:
    values = campaign.runs[metric][rows].astype(float)
    return values[np.isfinite(values)]
