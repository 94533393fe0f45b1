"""Sequential stopping: iterate until the interval is narrow enough, and what that costs.

A rule that looks at the data stops too early where they happen to vary little. Intervals that are
exact at a fixed number of values therefore hold the mean less often. The share of intervals that
hold it is simulated here, and belongs beside the interval.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from desim.engine.streams import Streams
from desim.statistics.intervals import FEWEST, t_interval

_MOST_DRAWS = 10_000_000  # about half a second


class StoppingRule(NamedTuple):
    """A rule for when to stop: half of the t interval is at most ``width``, in the values' unit, or
    as a share of the mean's size if ``relative``. Not before ``at_least`` values; in any case at
    ``at_most``."""

    width: float
    relative: bool = False
    at_least: int = 5
    at_most: int = 100
    level: float = 0.95


class IntervalCoverage(NamedTuple):
    """The ``share`` of ``experiments`` whose interval held the mean, with its standard ``error``;
    the mean number of values; the share that stopped because the interval was ``narrow``."""

    share: float
    error: float
    mean_n: float
    narrow: float
    experiments: int


def enough(values: ArrayLike, width: float, relative: bool = False, at_least: int = 5,
           at_most: int = 100, level: float = 0.95) -> bool:
    """Whether ``values`` [n], in the order in which they came, are enough (the fixed-width rule of
    Chow and Robbins 1965); ``enough(values, *rule)`` with a ``StoppingRule``. Raises ``ValueError``
    unless 2 <= at_least <= at_most and 0 < width."""
    _check(StoppingRule(width, relative, at_least, at_most, level))
    n = np.size(values)
    if n < at_least or n >= at_most:
        return n >= at_most
    found = t_interval(values, level)
    scale = abs(found.mean or 0.0) if relative else 1.0
    return found.half_width is not None and found.half_width <= width * scale


@lru_cache(maxsize=256)
def coverage_of(rule: StoppingRule, mean: float = 0.0, deviation: float = 1.0,
                experiments: int = 10_000, seed: int = 0) -> IntervalCoverage:
    """The coverage of the t interval when the rule stops, for normal values with ``mean`` and
    standard ``deviation``: so many simulated ``experiments``, fewer if the rule allows more than
    1000 values. A report takes mean and deviation from its values. Raises ``ValueError`` as
    ``enough`` does, and for a deviation that is not above zero."""
    _check(rule)
    if not deviation > 0:
        raise ValueError(f"the deviation must be above zero, got {deviation}")
    experiments = max(100, min(experiments, _MOST_DRAWS // rule.at_most))
    draw = Streams(seed)("statistics", "sequential")
    batch = max(1, 500_000 // rule.at_most)
    held, narrow, values = np.sum([_played(rule, mean, draw.normal(
        mean, deviation, (min(batch, experiments - begin), rule.at_most)))
        for begin in range(0, experiments, batch)], axis=0).tolist()
    share = held / experiments
    return IntervalCoverage(share, (share * (1 - share) / experiments)**0.5, values / experiments,
                    narrow / experiments, experiments)


def _played(rule: StoppingRule, mean: float, draws: np.ndarray) -> tuple[int, int, int]:
    """Of experiments [m, at_most]: how many hold the mean, how many stop by width, values used."""
    n = np.arange(1, rule.at_most + 1)
    # Around the mean, so that the sum of squares does not cancel.
    centred = draws - mean
    means = centred.cumsum(axis=1) / n
    variances = ((centred**2).cumsum(axis=1) - n * means**2) / np.maximum(n - 1, 1)
    student = stats.t.ppf((1 + rule.level) / 2, np.maximum(n - 1, 1))
    half = student * np.sqrt(np.maximum(variances, 0.0) / n)
    allowed = rule.width * (np.abs(means + mean) if rule.relative else 1.0)
    stops = half <= allowed
    stops[:, :max(rule.at_least, FEWEST) - 1] = False
    narrow = stops.any(axis=1)
    last = np.where(narrow, stops.argmax(axis=1), rule.at_most - 1)
    there = np.arange(len(draws)), last
    return (np.abs(means[there]) <= half[there]).sum(), narrow.sum(), (last + 1).sum()


def _check(rule: StoppingRule) -> None:
    if not (2 <= rule.at_least <= rule.at_most and rule.width > 0):
        raise ValueError("2 <= at_least <= at_most and 0 < width are needed, got "
                         f"at_least {rule.at_least}, at_most {rule.at_most}, width {rule.width}")
