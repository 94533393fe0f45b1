"""Comparisons of settings, run by run under common random numbers, corrected for their number."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np

from desim.report.campaign.numbers.estimates import Estimates
from desim.report.campaign.numbers.study import Axis, Study, VectorRuns
from desim.statistics.comparisons import Paired, holm, paired

MOST = 500  # comparisons of a metric
# Fewer seeds are compared and not tested: of the differences of three seeds nobody can tell whether
# they are near normal, and Wilcoxon's test cannot get below p = 0.0625 with five.
FEWEST_SEEDS = 5
_ALL_PAIRS = 6  # up to so many levels each is compared with each, else with the next one


class Contrast(NamedTuple):
    """``first`` compared with ``second``, two levels of ``axis``, with all other parameters at
    ``where``. ``p`` is that of the t test after Holm's correction over the comparisons of the
    metric; None if nothing could be tested, or if there are too few seeds (``FEWEST_SEEDS``)."""

    axis: str
    where: str
    first: str
    second: str
    paired: Paired
    p: float | None


def contrasts(study: Study, estimates: Estimates, metric: str) -> list[Contrast]:
    """The comparisons of a metric: the lines at each value of the axis, and neighbouring values
    (all, of few) where the axis has no numbers or there is only one line. None without common
    random numbers, or where no two runs share a seed."""
    if not study.is_paired or study.is_sampled or study.against is None:
        return []
    made = []
    for axis, one, other in _pairs(study):
        first, second = (by_iteration(study, estimates, metric, vector)
                         for vector in (one, other))
        shared = sorted(first.keys() & second.keys())
        if len(shared) > 1:
            rest = [each for each in study.axes.values() if each is not axis]
            made.append(Contrast(
                axis.name, study.label(one, *rest) if rest else "", axis.label(one),
                axis.label(other),
                paired([first[k] for k in shared], [second[k] for k in shared]), None))
        if len(made) == MOST:
            break
    tested = {i: p for i, one in enumerate(made) if (p := one.paired.t_p) is not None
              and one.paired.difference.n >= FEWEST_SEEDS}
    for i, p in zip(tested, holm(list(tested.values())), strict=True):
        made[i] = made[i]._replace(p=float(p))
    return made


def by_iteration(study: Study, estimates: Estimates, metric: str, vector: VectorRuns,
                 ) -> dict[int, float]:
    """The values of a vector by iteration. Times count up to the limit."""
    values = estimates.column(metric)[0][vector.rows]
    there = np.isfinite(values)
    return dict(zip(study.iterations[vector.rows[there]].tolist(), values[there].tolist(),
                    strict=True))


def _pairs(study: Study) -> Iterator[tuple[Axis, VectorRuns, VectorRuns]]:
    against, by = study.axis, study.by
    if by is not None and len(by.labels) > 1:
        yield from _along(study, by)
    if by is None or len(by.labels) == 1 or not against.is_numeric:
        yield from _along(study, against)


def _along(study: Study, axis: Axis) -> Iterator[tuple[Axis, VectorRuns, VectorRuns]]:
    """Pairs of vectors that differ in the level of ``axis`` alone."""
    alike: dict[tuple[int, ...], list[VectorRuns]] = defaultdict(list)
    for vector in study.vectors:
        alike[tuple(level for name, level in vector.levels.items() if name != axis.name)].append(
            vector)
    for key in sorted(alike):
        group = sorted(alike[key], key=lambda vector: vector.levels[axis.name])
        few = len(group) <= _ALL_PAIRS and (not axis.is_numeric or axis is study.by)
        for one, other in combinations(group, 2) if few else zip(group, group[1:], strict=False):
            if one.levels[axis.name] != other.levels[axis.name]:
                yield axis, one, other


def strongest(found: list[Contrast]) -> list[Contrast]:
    """The contrasts that are significant at 5 % after the correction, the largest effect first."""
    return sorted((one for one in found if one.p is not None and one.p < 0.05),
                  key=lambda one: -abs(one.paired.cohen_dz or np.inf))
