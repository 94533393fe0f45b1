"""Where a line bends: the knee of saturation, and the order in which several metrics give in."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from desim.report.campaign import wording
from desim.report.campaign.estimates import Estimates
from desim.report.campaign.lines import Line
from desim.report.campaign.study import Axis, Study
from desim.statistics.bends import bends_of
from desim.statistics.knee import Knee, breakpoint_of

FEWEST_LOADS, FEWEST_RUNS = 5, 8
ONSET = 0.95  # of the best mean of a line
_STRAIGHT = "lines that meet do no better than a straight one"
_MOST_POINTS = 2000  # of a line
MOST_WITH_TWO = 100  # lines of which a second knee is looked for, a fifth of a second each
_MOST_CELLS = 60_000_000  # resamples times points of all lines: some seconds


class Bend(NamedTuple):
    """What is known of one ``line``, which ``place`` tells from the others: its ``knees``, at most
    two; none where a straight line does as well, or where it could not be looked for, for the
    ``reason``."""

    line: Line
    place: str
    knees: tuple[Knee, ...]
    reason: str

    @property
    def was_sought(self) -> bool:
        """Whether there were enough loads to look for one."""
        return self.reason in ("", _STRAIGHT)


class Knees:
    """Looks for knees; for ``count`` lines in all, which says how long each may take."""

    def __init__(self, study: Study, estimates: Estimates, count: int) -> None:
        self._study, self._estimates, self._count = study, estimates, count
        self._find = bends_of if count <= MOST_WITH_TWO else _one

    def of(self, metric: str, line: Line, place: str) -> Bend:
        """The knees of a line of the metric's figure. Of very many runs the first iterations."""
        study, axis = self._study, self._study.against
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
            return Bend(line, place, (), f"that wants {FEWEST_LOADS} values of {axis.name} and "
                                         f"{FEWEST_RUNS} runs with results")
        resamples = min(max(_MOST_CELLS // (self._count * len(loads)), 499), 1999)
        knees = self._find(loads, values, log=axis.log, resamples=resamples, blocks=blocks)
        return Bend(line, place, knees, "" if knees else _STRAIGHT)


def _one(*arguments: np.ndarray, **more: Any) -> tuple[Knee, ...]:
    knee = breakpoint_of(*arguments, **more)
    return (knee,) if knee else ()


def _whole(loads: np.ndarray, iterations: np.ndarray) -> np.ndarray:
    """[n] of which iterations there is a value at each load: what a seed adds to all of them can be
    told only of those."""
    which, counts = np.unique(iterations, return_counts=True)
    return np.isin(iterations, which[counts == len(np.unique(loads))])


def sentences(bends: list[Bend], axis: Axis, metric: str) -> list[str]:
    """All of a metric's lines in words, those without a knee together."""
    out = [_sentence(one, axis, metric) for one in bends if one.knees]
    for reason in dict.fromkeys(one.reason for one in bends if not one.knees):
        without = [one for one in bends if not one.knees and one.reason == reason]
        where = "" if len(without) == len(bends) or not without[0].place \
            else f" for {wording.listed([one.place for one in without])}"
        out.append(f"No knee of {wording.titled(metric)}{where}: {reason}.")
    return out


def _sentence(bend: Bend, axis: Axis, metric: str) -> str:
    label, first = bend.place, bend.knees[0]
    per = "decade" if axis.log else axis.unit or "1"
    slopes = [wording.number(slope) for slope in (
        first.slope_before, *(knee.slope_after for knee in bend.knees))]
    places = wording.listed([f"{wording.quantity(knee.at, axis.unit)} (95 % interval "
                             f"{interval(knee, axis)})" for knee in bend.knees])
    fewer = "a single straight line" if len(bend.knees) == 1 else "fewer lines"
    return (f"{label + ': k' if label else 'K'}nee{'s' if len(bend.knees) > 1 else ''} of "
            f"{wording.titled(metric)} at {axis.name} {places}; slopes {wording.listed(slopes)} "
            f"per {per}, from low to high; p of {fewer} {wording.probability(first.p)}.")


def interval(knee: Knee, axis: Axis) -> str:
    """From where to where; a bound at the second load, or the last but one, is open: that is as far
    as a knee is looked for."""
    low, high = (wording.quantity(value, axis.unit) for value in (knee.low, knee.high))
    is_low, is_high = (bool(np.isclose(bound, edge)) for bound, edge in (
        (knee.low, axis.numbers[1]), (knee.high, axis.numbers[-2])))
    if is_low and is_high:
        return "open at both ends"
    if is_low or is_high:
        return f"below {high}" if is_low else f"above {low}"
    number, _, unit = low.partition(" ")
    return f"{number if high.endswith(f' {unit}') else low} to {high}"


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
