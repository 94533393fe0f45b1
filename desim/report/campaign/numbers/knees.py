"""The knee of saturation, where a line bends, and the onset of a metric's fall."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from desim.report.campaign import formatting
from desim.report.campaign.numbers.estimates import Estimates
from desim.report.campaign.numbers.lines import PlotLine
from desim.report.campaign.numbers.study import Axis, Study
from desim.statistics.knee import FEWEST_LOADS, FEWEST_RUNS, Knee, breakpoint_of
from desim.statistics.two_knees import knees_of

ONSET = 0.95  # of the best mean of a line
_STRAIGHT = "lines that meet do no better than a straight one"
_MOST_POINTS = 2000  # of a line
MOST_WITH_TWO = 100  # lines in which a second knee is sought, a fifth of a second each
_MOST_CELLS = 60_000_000  # resamples times points of all lines: some seconds


class LineKnees(NamedTuple):
    """At most two knees of one line. ``place`` is the line's name. Without a knee, ``reason`` says
    why."""

    line: PlotLine
    place: str
    knees: tuple[Knee, ...]
    reason: str

    @property
    def was_sought(self) -> bool:
        """Whether there were enough loads to seek a knee."""
        return self.reason in ("", _STRAIGHT)


class Knees:
    """Finds knees. ``count`` is the number of lines in all: of many, each gets less time."""

    def __init__(self, study: Study, estimates: Estimates, count: int) -> None:
        self._study, self._estimates, self._count = study, estimates, count

    def of(self, metric: str, line: PlotLine, place: str) -> LineKnees:
        """The knees of a line of the metric's figure. Of very many runs the first iterations."""
        study, axis = self._study, self._study.axis
        found = [(self._estimates.of(metric, vector), axis.numbers[vector.levels[axis.name]])
                 for vector in line.vectors]
        loads = np.concatenate([np.full(one.n, x) for one, x in found])
        values = np.concatenate([one.values for one, _ in found])
        iterations = study.iterations[np.concatenate([one.rows for one, _ in found])]
        early = iterations < max(_MOST_POINTS // len(line.vectors), 1)
        loads, values, iterations = loads[early], values[early], iterations[early]
        blocks = None
        if study.is_paired:
            whole = _whole(loads, iterations)
            if 2 * whole.sum() >= max(len(whole), 2 * FEWEST_RUNS):
                loads, values, blocks = loads[whole], values[whole], iterations[whole]
        if len(np.unique(loads)) < FEWEST_LOADS or len(loads) < FEWEST_RUNS:
            return LineKnees(line, place, (), f"that wants {FEWEST_LOADS} values of {axis.name} "
                                              f"and {FEWEST_RUNS} runs with results")
        resamples = min(max(_MOST_CELLS // (self._count * len(loads)), 499), 1999)
        if self._count <= MOST_WITH_TWO:
            knees = knees_of(loads, values, axis.log, resamples=resamples, blocks=blocks)
        else:
            knee = breakpoint_of(loads, values, axis.log, resamples=resamples, blocks=blocks)
            knees = (knee,) if knee else ()
        return LineKnees(line, place, knees, "" if knees else _STRAIGHT)


def _whole(loads: np.ndarray, iterations: np.ndarray) -> np.ndarray:
    """A mask [n] of iterations with a value at each load. Only these show the effect of a seed on
    all values."""
    which, counts = np.unique(iterations, return_counts=True)
    return np.isin(iterations, which[counts == len(np.unique(loads))])


def sentences(bends: list[LineKnees], axis: Axis, metric: str) -> list[str]:
    """All of a metric's lines in words, those without a knee together."""
    out = [_sentence(one, axis, metric) for one in bends if one.knees]
    for reason in dict.fromkeys(one.reason for one in bends if not one.knees):
        without = [one for one in bends if not one.knees and one.reason == reason]
        where = "" if len(without) == len(bends) or not without[0].place \
            else f" for {formatting.listed([one.place for one in without])}"
        out.append(f"No knee of {formatting.titled(metric)}{where}: {reason}.")
    return out


def _sentence(bend: LineKnees, axis: Axis, metric: str) -> str:
    label, first = bend.place, bend.knees[0]
    per = "decade" if axis.log else axis.unit or "1"
    slopes = [formatting.number(slope) for slope in (
        first.slope_before, *(knee.slope_after for knee in bend.knees))]
    places = formatting.listed([f"{formatting.quantity(knee.at, axis.unit)} (95 % interval "
                                f"{interval(knee, axis)})" for knee in bend.knees])
    fewer = "a single straight line" if len(bend.knees) == 1 else "fewer lines"
    return (f"{label + ': k' if label else 'K'}nee{'s' if len(bend.knees) > 1 else ''} of "
            f"{formatting.titled(metric)} at {axis.name} {places}; slopes "
            f"{formatting.listed(slopes)} per {per}, from low to high; "
            f"p of {fewer} {formatting.probability(first.p)}.")


def interval(knee: Knee, axis: Axis) -> str:
    """The interval in words. A bound at the second load, or at the last but one, is open: a knee is
    not sought beyond."""
    low, high = (formatting.quantity(value, axis.unit) for value in (knee.low, knee.high))
    is_low, is_high = (bool(np.isclose(bound, edge)) for bound, edge in (
        (knee.low, axis.numbers[1]), (knee.high, axis.numbers[-2])))
    if is_low and is_high:
        return "open at both ends"
    if is_low or is_high:
        return f"below {high}" if is_low else f"above {low}"
    number, _, unit = low.partition(" ")
    return f"{number if high.endswith(f' {unit}') else low} to {high}"


class Onset(NamedTuple):
    """The point at which a line begins to fall: on the way from the vector of its ``best`` mean to
    the worse end, the first vector ``at`` which the mean is below 95 % of the best; None if there
    is none. ``sign`` is the direction of that way along the axis."""

    best: int
    at: int | None
    sign: int


def onset(estimates: Estimates, metric: str, line: PlotLine) -> Onset | None:
    """The onset in a metric of which more is better; None where no run has the metric."""
    means = {i: mean for i, mean in enumerate(
        estimates.of(metric, vector).mean for vector in line.vectors) if mean is not None}
    if not means:
        return None
    ends = list(means.values())
    sign = -1 if ends[-1] >= ends[0] else 1
    way = list(means)[::sign]
    # Of equals, the last one on the way.
    best = max(way, key=lambda i: (means[i], way.index(i)))
    at = next((i for i in way[way.index(best):] if means[i] < ONSET * means[best]), None)
    return Onset(best, at, sign)
