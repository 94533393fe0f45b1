"""Sequential stopping: how often an interval holds the mean whose width ended the iterations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from desim.campaign.design.design import Until
from desim.campaign.running.agenda import stopping_rule
from desim.report.campaign.numbers.estimates import Estimates
from desim.report.campaign.numbers.study import Study, VectorRuns
from desim.report.campaign.tables.table import Cell, ReportTable
from desim.statistics.sequential import IntervalCoverage, coverage_of

_DIGITS = 2  # of the spread, so that vectors alike are simulated once
_MOST_SIMULATED = 24  # different ones


class Covered(NamedTuple):
    """The coverage of the interval of a vector with ``n`` values that spread like the vector's own.
    """

    vector: VectorRuns
    n: int
    coverage: IntervalCoverage


def measured(study: Study, estimates: Estimates) -> list[Covered]:
    """The coverage of each vector of a design that iterates until its metric is known. Those whose
    values do not vary, and those that would take too long, are left out."""
    until = study.design.iterations
    if not isinstance(until, Until) or until.metric not in study.metrics:
        return []
    rule, simulated = stopping_rule(until), set[float]()
    out: list[Covered] = []
    for vector in study.vectors:
        values = estimates.of(until.metric, vector).values
        if len(values) < 2 or not np.ptp(values) > 0:
            continue
        # Only the spread in units of the mean, or of the width, matters.
        mean, scale = (1.0, abs(values.mean())) if rule.relative else (0.0, 1.0)
        if scale == 0.0:
            continue
        deviation = float(f"{values.std(ddof=1) / scale:.{_DIGITS}g}")
        if deviation not in simulated and len(simulated) == _MOST_SIMULATED:
            continue
        simulated.add(deviation)
        out.append(Covered(vector, len(values), coverage_of(rule, mean, deviation)))
    return out


def coverage_table(study: Study, metric: str, found: list[Covered]) -> ReportTable:
    """The coverage of each vector, as a table."""
    rows: list[list[Cell]] = [[
        study.label(one.vector), one.n, one.coverage.share, one.coverage.mean_n,
        one.coverage.narrow] for one in found]
    head = ["vector", "runs", "holds the mean", "runs needed on average", "stopped by width"]
    return ReportTable(
        f"{metric}_coverage", "Sequential stopping: how often a nominal 95 % interval holds the "
        "mean when this rule stops, simulated for normal values that spread as measured.", head,
        rows, head, rows)
