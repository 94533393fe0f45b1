"""Where a line bends: the knee of saturation, and the order in which several metrics give in."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from desim.report.campaign import wording
from desim.report.campaign.estimates import Estimates
from desim.report.campaign.lines import Line
from desim.report.campaign.study import Axis, Study
from desim.statistics.knee import Knee, breakpoint_of

FEWEST_LOADS = 5
ONSET = 0.95  # of the best mean of a line
_MOST_CELLS = 8_000_000  # resamples times points, for the memory


class Bend(NamedTuple):
    """What is known of one ``line``: its ``knee``; None where a straight line does as well, or
    where it could not be looked for, for the ``reason``."""

    line: Line
    knee: Knee | None
    reason: str


def bend(study: Study, estimates: Estimates, metric: str, line: Line) -> Bend:
    """The knee of a line of the metric's figure."""
    axis = study.against
    found = [(estimates.of(metric, vector), axis.numbers[vector.levels[axis.name]])
             for vector in line.vectors]
    loads = np.concatenate([np.full(one.n, x) for one, x in found])
    values = np.concatenate([one.values for one, _ in found])
    iterations = study.iterations[np.concatenate([one.rows for one, _ in found])]
    if len(np.unique(loads)) < FEWEST_LOADS:
        return Bend(line, None, f"fewer than {FEWEST_LOADS} values of {axis.name} with results")
    balanced = len({tuple(np.sort(study.iterations[one.rows])) for one, _ in found}) == 1
    resamples = min(1999, max(399, _MOST_CELLS // len(loads)))
    if resamples * len(loads) > 4 * _MOST_CELLS:
        return Bend(line, None, "too many runs to look for one")
    knee = breakpoint_of(loads, values, log=axis.log, resamples=resamples,
                         blocks=iterations if study.is_paired and balanced else None)
    return Bend(line, knee, "" if knee else "a straight line does as well")


def sentence(bend: Bend, axis: Axis, metric: str) -> str:
    """It in words."""
    name = f"{bend.line.label}: " if bend.line.label else ""
    if bend.knee is None:
        return f"{name}no knee of {wording.titled(metric)} ({bend.reason})."
    knee = bend.knee
    # A bound at the second load, or the last but one, is as far as a knee is looked for.
    low, high = (wording.quantity(value, axis.unit) for value in (knee.low, knee.high))
    per = "decade" if axis.log else axis.unit or "1"
    return (f"{name}knee of {wording.titled(metric)} at {axis.name} "
            f"{wording.quantity(knee.at, axis.unit)} (95 % interval {low} to {high}"
            f"{_open(knee, axis)}; slope {wording.number(knee.slope_before)} below and "
            f"{wording.number(knee.slope_after)} above, per {per}; "
            f"p of a straight line {wording.probability(knee.p)}).")


def _open(knee: Knee, axis: Axis) -> str:
    inner = axis.numbers[1], axis.numbers[-2]
    ends = [word for word, bound, edge in (("below", knee.low, inner[0]),
                                           ("above", knee.high, inner[1]))
            if np.isclose(bound, edge)]
    return f", open {' and '.join(ends)}" if ends else ""


def onset(estimates: Estimates, metric: str, line: Line) -> int | None:
    """Going from the end of the line with the better (higher) mean to the other: the index of the
    first of its vectors with a mean under 95 % of the best. None if there is none."""
    means = [estimates.of(metric, vector).mean for vector in line.vectors]
    known = [(i, mean) for i, mean in enumerate(means) if mean is not None]
    if not known:
        return None
    best = max(mean for _, mean in known)
    if known[-1][1] > known[0][1]:
        known.reverse()
    return next((i for i, mean in known if mean < ONSET * best), None)
