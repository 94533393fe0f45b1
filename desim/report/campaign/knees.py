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
_STRAIGHT = "two lines that meet do no better than one"
_MOST_POINTS = 2000  # of a line
_MOST_CELLS = 60_000_000  # resamples times points of all lines: some seconds


class Bend(NamedTuple):
    """What is known of one ``line``: its ``knee``; None where a straight line does as well, or
    where it could not be looked for, for the ``reason``."""

    line: Line
    knee: Knee | None
    reason: str

    @property
    def was_sought(self) -> bool:
        """Whether there were enough loads to look for one."""
        return self.reason in ("", _STRAIGHT)


class Knees:
    """Looks for knees; for ``count`` lines in all, which says how long each may take."""

    def __init__(self, study: Study, estimates: Estimates, count: int) -> None:
        self._study, self._estimates, self._count = study, estimates, count

    def of(self, metric: str, line: Line) -> Bend:
        """The knee of a line of the metric's figure. Of very many runs the first iterations."""
        study, axis = self._study, self._study.against
        found = [(self._estimates.of(metric, vector), axis.numbers[vector.levels[axis.name]])
                 for vector in line.vectors]
        loads = np.concatenate([np.full(one.n, x) for one, x in found])
        values = np.concatenate([one.values for one, _ in found])
        iterations = study.iterations[np.concatenate([one.rows for one, _ in found])]
        early = iterations < max(_MOST_POINTS // len(line.vectors), 1)
        loads, values, iterations = loads[early], values[early], iterations[early]
        if len(np.unique(loads)) < FEWEST_LOADS:
            return Bend(line, None,
                        f"fewer than {FEWEST_LOADS} values of {axis.name} with results")
        counts = np.unique(np.unique(iterations, return_counts=True)[1])
        balanced = len(counts) == 1 and counts[0] == len(np.unique(loads))
        resamples = min(max(_MOST_CELLS // (self._count * len(loads)), 499), 1999)
        knee = breakpoint_of(loads, values, log=axis.log, resamples=resamples,
                             blocks=iterations if study.is_paired and balanced else None)
        return Bend(line, knee, "" if knee else _STRAIGHT)


def sentences(bends: list[Bend], axis: Axis, metric: str) -> list[str]:
    """All of a metric's lines in words, those without a knee together."""
    out = [_sentence(one, axis, metric) for one in bends if one.knee]
    for reason in dict.fromkeys(one.reason for one in bends if not one.knee):
        without = [one for one in bends if not one.knee and one.reason == reason]
        where = "" if len(without) == len(bends) or not without[0].line.label \
            else f" for {wording.listed([one.line.label for one in without])}"
        out.append(f"No knee of {wording.titled(metric)}{where}: {reason}.")
    return out


def summary(bends: list[Bend], axis: Axis, metric: str) -> list[str]:
    """The knees of a metric in one sentence; nothing if there are none."""
    told = [f"{wording.quantity(one.knee.at, axis.unit)} (95 % interval {_interval(one, axis)}"
            f"{', ' + one.line.label if one.line.label else ''})" for one in bends if one.knee]
    return [f"Knee of {wording.titled(metric)} at {axis.name} {wording.listed(told)}."] \
        if told else []


def _sentence(bend: Bend, axis: Axis, metric: str) -> str:
    knee, label = bend.knee, bend.line.label
    per = "decade" if axis.log else axis.unit or "1"
    return (f"{label + ': k' if label else 'K'}nee of {wording.titled(metric)} at {axis.name} "
            f"{wording.quantity(knee.at, axis.unit)}, 95 % interval {_interval(bend, axis)}; slope "
            f"{wording.number(knee.slope_before)} below and {wording.number(knee.slope_after)} "
            f"above, per {per}; p of a single straight line "
            f"{wording.probability(knee.p)}.")


def _interval(bend: Bend, axis: Axis) -> str:
    low, high = (wording.quantity(value, axis.unit) for value in (bend.knee.low, bend.knee.high))
    return f"{low} to {high}{_open(bend.knee, axis)}"


def _open(knee: Knee, axis: Axis) -> str:
    """A bound at the second load, or the last but one, is as far as a knee is looked for."""
    inner = axis.numbers[1], axis.numbers[-2]
    ends = [word for word, bound, edge in (("below", knee.low, inner[0]),
                                           ("above", knee.high, inner[1]))
            if np.isclose(bound, edge)]
    return f", open {' and '.join(ends)}" if ends else ""


class Onset(NamedTuple):
    """Where a line gives in: from the vector with its ``best`` mean towards the worse end, the
    first vector ``at`` which the mean is under 95 % of that; None if there is none. ``sign`` is the
    direction of that way along the axis."""

    best: int
    at: int | None
    sign: int


def onset(estimates: Estimates, metric: str, line: Line) -> Onset | None:
    """Of a metric of which more is better; None where no run has it."""
    means = {i: mean for i, mean in enumerate(
        estimates.of(metric, vector).mean for vector in line.vectors) if mean is not None}
    if not means:
        return None
    ends = list(means.values())
    sign = -1 if ends[-1] >= ends[0] else 1
    way = list(means)[::sign]
    # Of equals, the last one on the way.
    best = max(way, key=lambda i: (means[i], way.index(i)))
    after = way[way.index(best):]
    return Onset(best, next((i for i in after if means[i] < ONSET * means[best]), None), sign)
