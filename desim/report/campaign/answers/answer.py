"""The answer to the design's question, in sentences with their uncertainty.

They describe how the first metric changes along the axis, and how the settings differ in it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from desim.report.campaign import formatting
from desim.report.campaign.numbers import (
    Axis,
    Estimate,
    Estimates,
    Panel,
    Study,
    VectorRuns,
)
from desim.report.campaign.numbers.contrasts import FEWEST_SEEDS, by_iteration
from desim.statistics.intervals import Interval, t_interval

_MOST = 6  # sentences of a kind


def answer_of(study: Study, estimates: Estimates, metric: str, panels: list[Panel]) -> list[str]:
    """The answer in sentences; none for samples of a space, which have no settings to compare."""
    if study.is_sampled or study.against is None:
        return []
    said = []
    if study.against.is_numeric and len(study.against.labels) > 1:
        ends = {panel.place(line): (line.vectors[0], line.vectors[-1])
                for panel in panels for line in panel.lines if len(line.vectors) > 1}
        if len(ends) > 1 and study.is_paired:
            last = len(study.against.labels) - 1
            said.append(_between(study, estimates, metric, study.against, last))
        said += [_along(study, estimates, metric, *line) for line in list(ends.items())[:_MOST]]
    words = next((axis for axis in (study.by, study.against) if axis is not None
                  and not axis.is_numeric and len(axis.labels) > 1), None)
    if words is not None and study.is_paired:
        said += [_between(study, estimates, metric, words, level)
                 for level in range(1, min(len(words.labels), _MOST + 1))]
    return [sentence for sentence in said if sentence]


def _along(study: Study, estimates: Estimates, metric: str, line: str,
           ends: tuple[VectorRuns, VectorRuns]) -> str:
    """A sentence about the change from one end of a line to the other."""
    axis = study.axis
    first, last = (estimates.of(metric, vector) for vector in ends)
    if first.mean is None or last.mean is None:
        return ""
    begin, end = map(axis.label, ends)
    named = f"{line + ': ' if line else ''}{formatting.titled(metric)}"
    if first.late == first.n and last.late == last.n:
        return f"{named}: no run reached the aim, neither at {axis.name} = {begin} nor at {end}."
    change = t_interval(_differences(study, estimates, metric,
                                     [ends] if study.is_paired else []))
    more = "" if change.low is None else (
        f": {formatting.number(change.mean, 3)} "
        f"{formatting.between(change.low, change.high)} more, seed by seed{_doubt(change)}")
    return (f"{named} goes from {_estimate(first)} at {axis.name} = {begin} to {_estimate(last)} "
            f"at {end}{more}.")


def _estimate(one: Estimate) -> str:
    bounds = "" if one.low is None else f" {formatting.between(one.low, one.high)}"
    return f"{formatting.at_least(one.mean, one.late, 3)}{bounds} (n = {one.n})"


def _between(study: Study, estimates: Estimates, metric: str, axis: Axis, level: int) -> str:
    """A sentence about a level of an axis and its first one (of numbers the lowest), as means over
    all other settings in which something is known of the difference."""
    both = [(pair, [estimates.of(metric, vector) for vector in pair])
            for pair in _pairs(study, axis, level)]
    known = [(pair, of) for pair, of in both if not _is_unknown(of)]
    if both and not known and all(one.n for _, of in both for one in of):
        return (f"{formatting.titled(metric)} of {axis.name} = {axis.labels[level]} and "
                f"{axis.labels[0]}: no run reached the aim, so that nothing is known of the "
                "difference.")
    found = t_interval(_differences(study, estimates, metric, [pair for pair, _ in known]))
    if found.mean is None:
        return ""
    first, second = axis.labels[0], axis.labels[level]
    mean = "" if len(both) == 1 else f", mean over {len(known)} settings of the rest"
    if any(one.late for _, of in known for one in of):
        mean += "; late runs count up to the limit"
    if len(known) < len(both):
        mean += f"; {len(both) - len(known)} more left out, of which nothing is known"
    if found.low is None or found.high is None:
        return (f"{formatting.titled(metric)} of {second} minus {first}: "
                f"{formatting.number(found.mean, 3)}, one seed{mean}.")
    words = (f"is {formatting.number(abs(found.mean), 3)} {'above' if found.mean > 0 else 'below'} "
             f"{first}" if found.low > 0 or found.high < 0
             else f"cannot be told from {first}: difference {formatting.number(found.mean, 3)}")
    return (f"{formatting.titled(metric)} of {axis.name} = {second} {words}, 95 % interval of "
            f"the difference {formatting.between(found.low, found.high)}, n = {found.n} seeds{mean}"
            f"{_doubt(found)}.")


def _is_unknown(levels: Sequence[Estimate]) -> bool:
    """Whether nothing is known of the difference of two levels: neither was reached in time by any
    run, or one has no runs."""
    return all(one.n == one.late for one in levels) or not all(one.n for one in levels)


def _doubt(found: Interval) -> str:
    return "" if found.n >= FEWEST_SEEDS else "; too few seeds for more than a hint"


def _pairs(study: Study, axis: Axis, level: int) -> list[tuple[VectorRuns, VectorRuns]]:
    """Pairs of vectors at the first level of ``axis`` and at ``level`` that agree in all other
    parameters."""
    def rest(vector: VectorRuns) -> tuple:
        return tuple(value for name, value in vector.levels.items() if name != axis.name)

    at = {level_: {rest(vector): vector for vector in study.vectors
                   if vector.levels[axis.name] == level_} for level_ in (0, level)}
    return [(at[0][key], at[level][key]) for key in at[0] if key in at[level]]


def _differences(study: Study, estimates: Estimates, metric: str,
                 pairs: list[tuple[VectorRuns, VectorRuns]]) -> np.ndarray:
    """The differences [seeds], second minus first, for the seeds that both have, as means over
    ``pairs``."""
    values = [[by_iteration(study, estimates, metric, vector) for vector in pair]
              for pair in pairs]
    shared = set.intersection(*(set(one) for pair in values for one in pair)) if values else set()
    return np.array([np.mean([second[k] - first[k] for first, second in values])
                     for k in sorted(shared)])
