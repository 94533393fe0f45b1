"""Warnings about the numbers: failed runs, missing metrics, intervals that hold less than 95 %."""

from __future__ import annotations

import numpy as np
from scipy import stats

from desim.campaign.design.design import Until
from desim.campaign.running.agenda import is_narrow, stopping_rule
from desim.campaign.running.warnings import raised_warning
from desim.report.campaign import formatting
from desim.report.campaign.answers import findings
from desim.report.campaign.answers.groups import MetricGroup
from desim.report.campaign.numbers import Estimates, Study
from desim.report.campaign.page import page
from desim.report.campaign.tables.table import Cell, ReportTable
from desim.statistics.sequential import IntervalCoverage, coverage_of

_MOST_ERRORS = 10  # causes of failure with a line each
_MANY = 10  # runs, from which t intervals hold 90 % and more of what we tried (docs/reports.md)
_MOST_TESTED = 1000  # vectors that are looked at one by one
# Level of the test, and the fewest residuals: three vectors of five runs. Simulated: of 3, 10, 20,
# 100 such vectors 4, 4, 3, 2 % get the warning where values are normal, and 59, 100, 100, 100 %
# where one run of five is four standard deviations off.
_ODD, _FEWEST_RESIDUALS = 0.01, 15
_FARTHEST = 1e-6  # probability of a residual: a farther one counts as this far
_DIGITS = 2  # of the spread, so that vectors alike are simulated once
_MOST_SIMULATED = 24  # different spreads, up to half a second each
_MOST_NAMED = 6  # vectors in a sentence


def failures(study: Study) -> str:
    """The failed runs by cause, as HTML."""
    errors = findings.causes_of(study)
    return "" if not errors else page.paragraph(
        f"{formatting.counted(errors.total(), 'run')} failed:", "warn") + page.items(
        [f"{count} × {error}" for error, count in errors.most_common(_MOST_ERRORS)])


def about_metrics(study: Study, single: list[str], groups: list[MetricGroup]) -> str:
    """Warnings about metrics that are shown, or are the design's own, as HTML."""
    finished = int((study.once & ~study.failed).sum())
    if not finished:
        return ""
    said = [f"{raised_warning(name, count, error, finished)}."
            for name, (count, error) in study.raised.items()]
    shown = {*study.raised, *single, *(group.pattern for group in groups)}
    absent = [name for name in dict.fromkeys((*study.design.report.metrics, *study.design.metrics))
              if name not in shown and not study.has(name)]
    if absent:
        said.append(f"No run has a value of {formatting.listed(absent)}.")
    return "".join(page.paragraph(text, "warn") for text in said)


def about_few(study: Study, estimates: Estimates, metrics: list[str]) -> str:
    """A warning about intervals that rest on few runs whose values are far from normal, as HTML.
    The residuals of all small vectors of a metric are pooled, because no test can decide from five
    values alone."""
    doubtful = [metric for metric in metrics if len(study.vectors) <= _MOST_TESTED and are_odd(
        [estimates.of(metric, vector).values for vector in study.vectors])]
    return "" if not doubtful else page.paragraph(
        f"Some vectors have fewer than {_MANY} runs, and the values of "
        f"{formatting.listed(doubtful)} are not near normal: their 95 % intervals may hold the "
        "mean much less often (66 % with 5 runs where values have two peaks). More iterations "
        "mend it.", "warn")


def are_odd(samples: list[np.ndarray]) -> bool:
    """Whether the small ones of these samples, each [n], are not from normal distributions (Shapiro
    and Wilk 1965), each with its own mean and variance.

    A residual of n normal values, in standard deviations of its sample, is not normal itself:
    (1 + r sqrt(n) / (n - 1)) / 2 has the distribution Beta(n/2 - 1, n/2 - 1) (Thompson 1935). So
    each becomes the normal quantile of its probability before all are pooled."""
    pooled: list[float] = []
    for values in samples:
        n = len(values)
        if 3 <= n < _MANY and np.ptp(values) > 0:
            residuals = (values - values.mean()) / values.std(ddof=1)
            halves = (1 + residuals * np.sqrt(n) / (n - 1)) / 2
            probability = stats.beta.cdf(halves, n / 2 - 1, n / 2 - 1)
            pooled += stats.norm.ppf(np.clip(probability, _FARTHEST, 1 - _FARTHEST)).tolist()
    return len(pooled) >= _FEWEST_RESIDUALS and float(stats.shapiro(pooled).pvalue) < _ODD


def about_width(study: Study, estimates: Estimates) -> str:
    """A sentence about the vectors whose interval is too wide after all runs that they may have;
    empty if there are none."""
    until = study.design.iterations
    if not isinstance(until, Until) or until.metric not in study.metrics:
        return ""
    wide = [study.label(vector) for vector in study.vectors if len(vector.rows) >= until.at_most
            and not is_narrow(estimates.of(until.metric, vector).values, stopping_rule(until))]
    return "" if not wide else (
        f"The 95 % interval of {until.metric} was still wider than {until.width} in {len(wide)} of "
        f"{formatting.counted(len(study.vectors), 'vector')} after {until.at_most} runs each"
        f"{f': {formatting.listed(wide, _MOST_NAMED)}' if study.axes else ''}.")


def coverage(study: Study, estimates: Estimates, metric: str) -> dict[int, IntervalCoverage]:
    """The coverage of a metric's intervals, by the number of the vector, simulated for normal
    values that spread as the vector's own. Empty unless its intervals ended the iterations; vectors
    whose values do not vary, and those that would take too long, are left out."""
    until = study.design.iterations
    if not isinstance(until, Until) or until.metric != metric:
        return {}
    rule, simulated = stopping_rule(until), set[float]()
    found = {}
    for vector in study.vectors:
        values = estimates.of(metric, vector).values
        # Only the spread in units of the mean, or of the width, matters.
        mean, scale = (1.0, abs(values.mean())) if rule.relative and len(values) else (0.0, 1.0)
        if len(values) < 2 or not np.ptp(values) > 0 or scale == 0.0:
            continue
        deviation = float(f"{values.std(ddof=1) / scale:.{_DIGITS}g}")
        if deviation in simulated or len(simulated) < _MOST_SIMULATED:
            simulated.add(deviation)
            found[vector.number] = coverage_of(rule, mean, deviation)
    return found


def coverage_table(study: Study, estimates: Estimates, metric: str,
                   found: dict[int, IntervalCoverage]) -> ReportTable:
    """The coverage of each vector, as a table."""
    rows: list[list[Cell]] = [[
        study.label(vector), estimates.of(metric, vector).n, one.share, one.mean_n, one.narrow]
        for vector in study.vectors if (one := found.get(vector.number))]
    head = ["vector", "runs", "holds the mean", "runs needed on average", "stopped by width"]
    return ReportTable(
        f"{metric}_coverage", "Sequential stopping: how often a nominal 95 % interval holds the "
        "mean when this rule stops, simulated for normal values that spread as measured.", head,
        rows, head, rows)
