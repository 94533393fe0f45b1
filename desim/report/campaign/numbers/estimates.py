"""Estimates of a metric in each vector: means with intervals, and times with censored runs."""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy import stats

from desim.report.campaign.numbers import bounds
from desim.report.campaign.numbers.study import TIMES, Study, VectorRuns
from desim.statistics import censoring
from desim.statistics.intervals import (
    BOOTSTRAP_FROM,
    FEWEST,
    RESAMPLES,
    Interval,
    interval,
    t_interval,
)

# Drawing so many values takes about ten seconds; what needs more gets fewer resamples, or t.
_MOST_DRAWS = 400_000_000
_FEWEST_RESAMPLES = 999


class Times(NamedTuple):
    """Further estimates of a time: the paper's mean of the successes, the median, and the number of
    ``late`` runs, which had not reached the aim at the ``limit`` and count with it."""

    successes: Interval
    median: censoring.Median
    limit: float
    late: int


class Estimate(NamedTuple):
    """The ``mean`` of one metric in one vector (restricted to the limit, for times) with its 95 %
    interval; None where it does not exist.

    ``values`` [n] are those of the runs that have the metric, up to the limit for times; ``rows``
    [n] are their places in the table. ``reached`` and ``failed`` count those of the ``runs`` that
    reached the aim and that failed.
    """

    mean: float | None
    low: float | None
    high: float | None
    method: str
    values: np.ndarray
    rows: np.ndarray
    runs: int
    reached: int
    failed: int
    times: Times | None

    @property
    def n(self) -> int:
        return len(self.values)

    @property
    def late(self) -> int:
        """The number of values of which only a lower bound is known."""
        return self.times.late if self.times else 0


class Means(NamedTuple):
    """Mean, bounds and number of values of a metric, each [vectors], NaN where it does not exist;
    ``late`` counts times for which the limit stands, because the run had not reached the aim."""

    mean: np.ndarray
    low: np.ndarray
    high: np.ndarray
    n: np.ndarray
    late: np.ndarray


class Estimates:
    """The estimates of all vectors of a study. ``resamples``: of a bootstrap; 0 if a campaign is
    too large for it, so that t intervals are used instead."""

    def __init__(self, study: Study) -> None:
        self._study = study
        self.limit, self.ends = cache(self._limit), cache(self._ends)
        self.bounds = cache(self._bounds)
        self.watched, self.column = cache(self._watched), cache(self._column)
        self._known: dict[tuple[str, int], Estimate] = {}
        draws = sum(len(vector.rows) for vector in study.vectors
                    if len(vector.rows) >= BOOTSTRAP_FROM) * len(study.design.report.metrics)
        fits = min(_MOST_DRAWS // max(draws, 1), RESAMPLES)
        self.resamples = fits if fits >= _FEWEST_RESAMPLES else 0

    def of(self, metric: str, vector: VectorRuns) -> Estimate:
        """The estimate of a metric in a vector, computed once."""
        key = metric, vector.number
        if key not in self._known:
            self._known[key] = self._made(metric, vector)
        return self._known[key]

    def means(self, metric: str) -> Means:
        """The means of all vectors at once, with t intervals, which is fast enough for a hundred
        thousand runs. Times count up to the limit."""
        study = self._study
        column, late = self.column(metric)
        order = np.concatenate([vector.rows for vector in study.vectors])
        sizes = [len(vector.rows) for vector in study.vectors]
        begins = np.cumsum([0, *sizes[:-1]])
        values = np.where(study.failed, np.nan, column)[order]
        there = np.isfinite(values)
        n = np.add.reduceat(there.astype(float), begins)
        late = np.add.reduceat(late[order].astype(float), begins)
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = np.add.reduceat(np.where(there, values, 0.0), begins) / n
            off = np.where(there, values - np.repeat(mean, sizes), 0.0)
            error = np.sqrt(np.add.reduceat(off**2, begins) / (n - 1) / n)
        bounded = (n >= FEWEST) & (late < n)
        half = np.where(bounded, stats.t.ppf(0.975, np.maximum(n - 1, 1)) * error, np.nan)
        least, greatest = self.bounds(metric)
        return Means(mean, np.maximum(mean - half, least), np.minimum(mean + half, greatest), n,
                     late)

    def _column(self, metric: str) -> tuple[np.ndarray, np.ndarray]:
        """Values [runs] of a metric, of times up to the limit, and which of these are late."""
        column = self._study.column(metric)
        if metric not in TIMES:
            return column, np.zeros(len(column), bool)
        limit, watched = self.limit(metric), self.watched(metric)
        if limit is None:
            return np.full(len(column), np.nan), np.zeros(len(column), bool)
        ends = self.ends(metric)
        return (np.where(watched, np.minimum(ends, limit), np.nan),
                watched & (np.isnan(column) | (ends > limit)))

    def _bounds(self, metric: str) -> bounds.Bounds:
        """The least and greatest possible mean; of times that the limit cut off, the limit."""
        least, greatest = bounds.of(self._study, metric)
        if metric in TIMES and (self.watched(metric)
                                & np.isnan(self._study.column(metric))).any():
            greatest = self.limit(metric) or greatest
        return least, greatest

    def _limit(self, metric: str) -> float | None:
        """The instant up to which all vectors that have this time were watched: the time limit of
        the design. None for a metric that is no time, and for instants that no run waited for."""
        if metric not in TIMES:
            return None
        ends, reached = self.ends(metric), ~np.isnan(self._study.column(metric))
        watched = self.watched(metric)
        if not watched.any() or (metric != TIMES[0] and not reached.any()):
            return None
        stopped = [ends[vector.rows][watched[vector.rows]].max() for vector in self._study.vectors
                   if (watched & ~reached)[vector.rows].any()]
        return float(min(stopped) if stopped else ends[watched].max())

    def _watched(self, metric: str) -> np.ndarray:
        """A mask [runs] of the finished runs of those vectors in which each run reached the aim or
        went on to its time limit. A run that stopped for another reason, such as that one robot
        knew enough, says nothing about a later time: its vector has no mean of it."""
        study, watched = self._study, ~self._study.failed
        lost = watched & np.isnan(study.column(metric)) & ~study.timed_out
        for vector in study.vectors if lost.any() else ():
            if lost[vector.rows].any():
                watched[vector.rows] = False
        return watched

    def _made(self, metric: str, vector: VectorRuns) -> Estimate:
        study, rows = self._study, vector.rows
        counts = len(rows), int(study.reached[rows].sum()), int(study.failed[rows].sum())
        if metric in TIMES:
            return self._time(metric, rows[self.watched(metric)[rows]], counts)
        column = study.column(metric)[rows]
        there = np.isfinite(column)
        # A rule that stops by a width looks at the t interval, whatever the number of runs.
        stops = getattr(study.design.iterations, "metric", None) == metric
        found = t_interval(column[there]) if stops else self.interval(column[there])
        found = found.within(*self.bounds(metric))
        return Estimate(found.mean, found.low, found.high, found.method, column[there],
                        rows[there], *counts, None)

    def interval(self, values: np.ndarray) -> Interval:
        """The mean of values [n] of as many runs, with the interval of all means of the report."""
        return interval(values, resamples=self.resamples) if self.resamples else t_interval(values)

    def _time(self, metric: str, rows: np.ndarray, counts: tuple[int, int, int]) -> Estimate:
        limit = self.limit(metric)
        if not len(rows) or limit is None:
            return Estimate(None, None, None, "none", np.zeros(0), rows[:0], *counts, None)
        ends, reached = self.ends(metric)[rows], ~np.isnan(self._study.column(metric)[rows])
        mean = censoring.restricted_mean(ends, reached, limit)
        least, greatest = self.bounds(metric)
        low, high = ((None, None) if mean.low is None or mean.high is None
                     else (max(mean.low, least), min(mean.high, greatest)))
        times = Times(self.interval(ends[reached]).within(least, math.inf),
                      censoring.median_time(ends, reached), limit,
                      int((~reached | (ends > limit)).sum()))
        return Estimate(mean.mean, low, high, "restricted", np.minimum(ends, limit), rows,
                        *counts, times)

    def _ends(self, metric: str) -> np.ndarray:
        """The instant [runs], or the end of the run if that is earlier."""
        instants = self._study.column(metric)
        return np.where(np.isnan(instants), self._study.column("simulated_s"), instants)
