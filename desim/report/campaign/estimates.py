"""What a metric comes to in each vector: means with intervals, and times with their censored runs.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy import stats

from desim.report.campaign.study import TIMES, Study, Vector
from desim.statistics import censoring
from desim.statistics.intervals import BOOTSTRAP_FROM, RESAMPLES, Interval, interval, t_interval

# Drawing so many values takes about ten seconds; what needs more gets fewer resamples, or t.
_MOST_DRAWS = 400_000_000
_FEWEST_RESAMPLES = 999


class Times(NamedTuple):
    """What else is said of times: the paper's mean of the successes, and the median."""

    successes: Interval
    median: censoring.Median
    limit: float


class Estimate(NamedTuple):
    """Of one metric in one vector: its ``mean`` (restricted to the limit, for times) with its 95 %
    interval; None is what does not exist.

    ``values`` [n] are those of the runs that have the metric, up to the limit for times, and
    ``rows`` [n] where they stand in the table. Of ``runs`` so many ``reached`` the aim and so many
    ``failed``.
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


class Means(NamedTuple):
    """Mean, bounds and number of values of a metric, each [vectors], NaN for what there is not."""

    mean: np.ndarray
    low: np.ndarray
    high: np.ndarray
    n: np.ndarray


class Estimates:
    """Of all vectors of a study. ``resamples`` of a bootstrap; 0 where t stands in for it, for a
    campaign too large."""

    def __init__(self, study: Study) -> None:
        self._study = study
        self.limit, self.ends = cache(self._limit), cache(self._ends)
        self._known: dict[tuple[str, int], Estimate] = {}
        draws = sum(len(vector.rows) for vector in study.vectors
                    if len(vector.rows) >= BOOTSTRAP_FROM) * len(study.design.report.metrics)
        fits = min(_MOST_DRAWS // max(draws, 1), RESAMPLES)
        self.resamples = fits if fits >= _FEWEST_RESAMPLES else 0

    def of(self, metric: str, vector: Vector) -> Estimate:
        """The estimate; worked out once."""
        key = metric, vector.number
        if key not in self._known:
            self._known[key] = self._made(metric, vector)
        return self._known[key]

    def means(self, metric: str) -> Means:
        """Of all vectors at once, by t: a hundred thousand runs are many. Times count up to the
        limit."""
        study, limit = self._study, self.limit(metric)
        column = study.column(metric) if limit is None else np.minimum(self.ends(metric), limit)
        order = np.concatenate([vector.rows for vector in study.vectors])
        sizes = [len(vector.rows) for vector in study.vectors]
        begins = np.cumsum([0, *sizes[:-1]])
        values = np.where(study.failed, np.nan, column)[order]
        there = np.isfinite(values)
        n = np.add.reduceat(there.astype(float), begins)
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = np.add.reduceat(np.where(there, values, 0.0), begins) / n
            off = np.where(there, values - np.repeat(mean, sizes), 0.0)
            error = np.sqrt(np.add.reduceat(off**2, begins) / (n - 1) / n)
        half = np.where(n < 2, np.nan, stats.t.ppf(0.975, np.maximum(n - 1, 1)) * error)
        return Means(mean, mean - half, mean + half, n)

    def _limit(self, metric: str) -> float | None:
        """Up to which instant all vectors were watched, which is the time limit of the design;
        None for what is no time, where no run ended, and for instants that nobody waited for."""
        if metric not in TIMES:
            return None
        ends, reached = self.ends(metric), ~np.isnan(self._study.column(metric))
        if metric != TIMES[0] and not reached.any():
            return None
        watched = []
        for vector in self._study.vectors:
            rows = vector.rows[~self._study.failed[vector.rows]]
            if (~reached[rows]).any():
                watched.append(ends[rows].max())
        finished = ends[~self._study.failed]
        return float(min(watched) if watched else finished.max()) if len(finished) else None

    def _made(self, metric: str, vector: Vector) -> Estimate:
        study, rows = self._study, vector.rows
        failed = study.failed[rows]
        counts = len(rows), int(study.reached[rows].sum()), int(failed.sum())
        if metric in TIMES:
            return self._time(metric, rows[~failed], counts)
        column = study.column(metric)[rows]
        there = np.isfinite(column)
        # A rule that stops by a width looks at the t interval, whatever the number of runs.
        stops = getattr(study.design.iterations, "metric", None) == metric
        found = t_interval(column[there]) if stops else self._interval(column[there])
        return Estimate(found.mean, found.low, found.high, found.method, column[there],
                        rows[there], *counts, None)

    def _interval(self, values: np.ndarray) -> Interval:
        return interval(values, resamples=self.resamples) if self.resamples else t_interval(values)

    def _time(self, metric: str, rows: np.ndarray, counts: tuple[int, int, int]) -> Estimate:
        limit = self.limit(metric)
        if not len(rows) or limit is None:
            return Estimate(None, None, None, "none", np.zeros(0), rows[:0], *counts, None)
        ends, reached = self.ends(metric)[rows], ~np.isnan(self._study.column(metric)[rows])
        mean = censoring.restricted_mean(ends, reached, limit)
        times = Times(self._interval(ends[reached]), censoring.median_time(ends, reached), limit)
        return Estimate(mean.mean, mean.low, mean.high, "restricted", np.minimum(ends, limit), rows,
                        *counts, times)

    def _ends(self, metric: str) -> np.ndarray:
        """[runs] the instant, or that at which the run was stopped before it."""
        instants = self._study.column(metric)
        return np.where(np.isnan(instants), self._study.column("simulated_s"), instants)
