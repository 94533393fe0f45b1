"""Censored times: some runs were stopped at the time limit before they reached the aim.

Such a run is right-censored: its time is longer than the limit, nobody knows by how much. The mean
of the successes leaves it out, so that a setting looks the better the fewer of its runs succeed;
the median and the restricted mean do not. Here ``times`` [n] are in any one unit, from zero, and
``reached`` [n] bool says which runs got there; the others were watched until their time. All
functions raise ``ValueError`` for times that are negative, not finite, or not as many.
"""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from desim.statistics.intervals import FEWEST
from desim.statistics.samples import sample


class Curve(NamedTuple):
    """A Kaplan-Meier curve, all [k]: just after each of ``times``, ascending, a ``share`` of the
    runs is not there yet, with the band from ``low`` to ``high``, NaN where it is not defined
    (before the first success, and at share 0). ``at_risk`` runs were under way just before, and
    ``events`` of them got there."""

    times: np.ndarray
    share: np.ndarray
    low: np.ndarray
    high: np.ndarray
    at_risk: np.ndarray
    events: np.ndarray


class Median(NamedTuple):
    """A median time and its interval. None where the runs do not reach it."""

    value: float | None
    low: float | None
    high: float | None


class RestrictedMean(NamedTuple):
    """The mean of min(time, ``limit``) of ``n`` runs, its standard error and interval. No error for
    a single run, and no bounds for fewer than three or where no run got there."""

    mean: float
    error: float | None
    low: float | None
    high: float | None
    limit: float
    n: int


def kaplan_meier(times: ArrayLike, reached: ArrayLike, level: float = 0.95) -> Curve:
    """The product-limit estimate (Kaplan and Meier 1958), its band from Greenwood's variance on the
    log-log scale (Kalbfleisch and Prentice 1980), at each instant by itself. A run that got there
    at the instant at which another was stopped came first. Raises ``ValueError`` for no runs."""
    ends, there = _runs(times, reached)
    curve = stats.ecdf(stats.CensoredData.right_censored(ends, ~there)).sf
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # said in ``Curve``: undefined at 1 and 0
        band = curve.confidence_interval(level, method="log-log")
    at_risk = (ends >= curve.quantiles[:, None]).sum(axis=1)
    events = (there & (ends == curve.quantiles[:, None])).sum(axis=1)
    return Curve(curve.quantiles, curve.probabilities, band.low.probabilities,
                 band.high.probabilities, at_risk, events)


def median_time(times: ArrayLike, reached: ArrayLike, level: float = 0.95) -> Median:
    """The instant at which half of the runs are there; where the curve stays at a half, the middle
    of that stretch, so that without censoring this is the ordinary median, and None if nobody saw
    its end. The interval is that of Brookmeyer and Crowley (1982): the instants at which the
    log-log band holds a half."""
    curve = kaplan_meier(times, reached, level)
    # Products of fractions: a half may be 0.5000000000000001.
    first = _first(curve.times, curve.share <= 0.5 + 1e-12)
    past = _first(curve.times, curve.share < 0.5 - 1e-12)
    value = None if first is None or past is None else (first + past) / 2
    return Median(value, _first(curve.times, curve.low <= 0.5),
                  _first(curve.times, curve.high <= 0.5))


def restricted_mean(times: ArrayLike, reached: ArrayLike, limit: float,
                    level: float = 0.95) -> RestrictedMean:
    """The area under the Kaplan-Meier curve up to ``limit`` (Irwin 1949; Royston and Parmar 2013).

    var = n / (n - 1) sum over times t of A(t)^2 e / (r (r - e)), A(t) the area from t to the limit,
    r runs at risk and e events (Greenwood; Klein and Moeschberger 2003, section 4.5, where the
    factor is absent), and bounds from Student's t with n - 1 degrees of freedom. So it is the mean
    of min(time, limit) with its ordinary t interval where all runs were watched up to the limit.
    Raises ``ValueError`` if none of those on the way was watched so long.
    """
    curve = kaplan_meier(times, reached, level)
    n = int(curve.at_risk[0])
    if limit <= 0 or (curve.times[-1] < limit and curve.share[-1] > 0):
        raise ValueError(f"nobody watched the runs up to {limit}, but up to {curve.times[-1]}")
    inside = curve.times < limit
    heights = np.append(1.0, curve.share[inside])
    areas = heights * np.diff(np.concatenate([[0.0], curve.times[inside], [limit]]))
    mean = float(areas.sum())
    if n == 1:
        return RestrictedMean(mean, None, None, None, limit, n)
    later = areas[:0:-1].cumsum()[::-1]
    events, at_risk = curve.events[inside], curve.at_risk[inside]
    # Where the last run gets there no area is left: 0 / 0 stands for 0.
    hazards = events / np.maximum(at_risk * (at_risk - events), 1)
    error = float(np.sqrt(n / (n - 1) * (later**2 * hazards).sum()))
    if n < FEWEST or not curve.events[curve.times <= limit].any():
        return RestrictedMean(mean, error, None, None, limit, n)
    half = float(stats.t.ppf((1 + level) / 2, n - 1)) * error
    return RestrictedMean(mean, error, mean - half, mean + half, limit, n)



def restricted(times: ArrayLike, reached: ArrayLike, limit: float) -> np.ndarray:
    """min(time, ``limit``) of each run [n]. Raises ``ValueError`` for a run that was neither there
    nor watched up to the limit."""
    ends, there = _runs(times, reached)
    if (~there & (ends < limit)).any():
        raise ValueError(f"a run was stopped on its way before the limit of {limit}")
    return np.minimum(ends, limit)


def _runs(times: ArrayLike, reached: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    ends, there = sample(times), np.asarray(reached, bool)
    if ends.shape != there.shape or not len(ends):
        raise ValueError(f"{ends.shape} times cannot belong to {there.shape} outcomes")
    if (ends < 0).any():
        raise ValueError("a time is negative")
    return ends, there


def _first(times: np.ndarray, holds: np.ndarray) -> float | None:
    return float(times[np.argmax(holds)]) if holds.any() else None
