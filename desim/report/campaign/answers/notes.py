"""Warnings about the numbers: failed runs, missing metrics, vectors with too wide an interval."""

from __future__ import annotations

import numpy as np
from scipy import stats

from desim.campaign.design.design import Until
from desim.campaign.running.agenda import is_narrow, stopping_rule
from desim.campaign.running.remarks import raised_remark
from desim.report.campaign import wording
from desim.report.campaign.answers import findings
from desim.report.campaign.answers.groups import MetricGroup
from desim.report.campaign.numbers.estimates import Estimates
from desim.report.campaign.numbers.study import Study, VectorRuns
from desim.report.campaign.page import page

_MOST_ERRORS = 10
_MANY = 10  # runs, from which t intervals hold 90 % and more of what we tried (docs/statistics.md)
_MOST_TESTED = 1000  # vectors
_FEWEST_RESIDUALS = 15


def failures(study: Study) -> str:
    """The failed runs by cause, as HTML."""
    errors = findings.causes_of(study)
    if not errors:
        return ""
    return page.paragraph(
        f"{wording.counted(errors.total(), 'run')} failed:", "warn") + page.items(
        [f"{count} × {error}" for error, count in errors.most_common(_MOST_ERRORS)])


def about_metrics(study: Study, single: list[str], groups: list[MetricGroup]) -> str:
    """Warnings about metrics that are shown, or are the design's own, as HTML."""
    finished = int((study.once & ~study.failed).sum())
    if not finished:
        return ""
    said = [f"{raised_remark(name, count, error, finished)}."
            for name, (count, error) in study.raised.items()]
    shown = {*single, *(group.pattern for group in groups)}
    asked = dict.fromkeys((*study.design.report.metrics, *study.design.metrics))
    absent = [name for name in asked if name not in study.raised and name not in shown
              and not study.has(name)]
    if absent:
        said.append(f"No run has a value of {wording.listed(absent)}.")
    return "".join(page.paragraph(text, "warn") for text in said)


def about_few(study: Study, estimates: Estimates, metrics: list[str]) -> str:
    """A warning about intervals that rest on few runs whose values are far from normal, as HTML.
    The residuals of all small vectors of a metric are pooled, each in standard deviations of its
    vector, because no test can decide from five values alone (Shapiro and Wilk 1965)."""
    doubtful = [metric for metric in metrics if _is_odd(study, estimates, metric)]
    if not doubtful:
        return ""
    return page.paragraph(
        f"Some vectors have fewer than {_MANY} runs, and the values of {wording.listed(doubtful)} "
        "are not near normal: their 95 % intervals may hold the mean much less often (66 % with "
        "5 runs where values have two peaks). More iterations mend it.", "warn")


def _is_odd(study: Study, estimates: Estimates, metric: str) -> bool:
    if len(study.vectors) > _MOST_TESTED:
        return False
    small = [estimates.of(metric, vector).values for vector in study.vectors]
    small = [values for values in small if 3 <= len(values) < _MANY and np.ptp(values) > 0]
    pooled = np.concatenate([(values - values.mean()) / values.std(ddof=1) for values in small]
                            or [np.zeros(0)])
    return len(pooled) >= _FEWEST_RESIDUALS and float(stats.shapiro(pooled).pvalue) < 0.01


def unsettled(study: Study, estimates: Estimates) -> list[VectorRuns]:
    """The vectors whose interval is too wide after all runs that they may have."""
    until = study.design.iterations
    if not isinstance(until, Until) or until.metric not in study.metrics:
        return []
    rule = stopping_rule(until)
    return [vector for vector in study.vectors if len(vector.rows) >= until.at_most
            and not is_narrow(estimates.of(until.metric, vector).values, rule)]


def about_width(study: Study, estimates: Estimates) -> str:
    """A sentence about unsettled vectors; empty if there are none."""
    wide, until = unsettled(study, estimates), study.design.iterations
    if not wide or not isinstance(until, Until):
        return ""
    some = wording.listed([study.label(vector) for vector in wide], 6)
    return (f"The 95 % interval of {until.metric} was still wider than {until.width} in "
            f"{len(wide)} of {wording.counted(len(study.vectors), 'vector')} after "
            f"{until.at_most} runs each{f': {some}' if study.axes else ''}.")
