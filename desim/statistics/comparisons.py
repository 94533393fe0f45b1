"""Two settings compared run by run under common random numbers, and many such comparisons at once.

Runs of one seed share their random numbers, so that their difference varies less than they do.
Only the differences are tested, never the two groups.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from desim.statistics.censoring import restricted
from desim.statistics.intervals import Interval, t_interval
from desim.statistics.samples import aligned, sample, spread


class Paired(NamedTuple):
    """The first setting compared with the second over ``difference.n`` seeds.

    ``difference``: mean of first - second with its t interval. ``t_p``, ``wilcoxon_p``: two-sided.
    ``cohen_dz``: mean difference in standard deviations of the differences. ``rank_biserial``, in
    [-1, 1]: 1 where the first is above the second for all seeds. ``above``, ``equal``, ``below``:
    the numbers of seeds for which the first is above, equal to and below the second; whether above
    is better depends on the metric. None: too few seeds, or nothing that varies.
    """

    difference: Interval
    t_p: float | None
    wilcoxon_p: float | None
    cohen_dz: float | None
    rank_biserial: float | None
    above: int
    equal: int
    below: int


class PairedTimes(NamedTuple):
    """``paired`` over times up to a limit, with the seeds for which both or one run reached it."""

    paired: Paired
    both_censored: int
    one_censored: int


def paired(first: ArrayLike, second: ArrayLike, level: float = 0.95) -> Paired:
    """Compare [n] with [n], value k of both from the same seed.

    Paired t test (Student 1908), Wilcoxon's signed-rank test (1945; equal pairs left out), d_z
    (Cohen 1988), matched-pairs rank-biserial correlation: the share of the rank sum in favour
    minus that against (Kerby 2014). Raises ``ValueError`` for samples that are not equally long.
    """
    a, b = aligned(first, second)
    differences = a - b
    # What only rounding has made different is equal.
    scale = max(np.abs(a).max(initial=0.0), np.abs(b).max(initial=0.0))
    differences[np.abs(differences) <= 1e-12 * scale] = 0.0
    t_p = cohen_dz = None
    deviation = spread(differences, scale) if len(a) > 1 else 0.0
    if deviation > 0.0:
        t_p = float(stats.ttest_1samp(differences, 0.0).pvalue)
        cohen_dz = float(differences.mean() / deviation)
    wilcoxon_p, rank_biserial = _signed_ranks(differences)
    return Paired(t_interval(differences, level), t_p, wilcoxon_p, cohen_dz, rank_biserial,
                  int((differences > 0).sum()), int((differences == 0).sum()),
                  int((differences < 0).sum()))


def paired_times(first: ArrayLike, first_reached: ArrayLike, second: ArrayLike,
                 second_reached: ArrayLike, limit: float, level: float = 0.95) -> PairedTimes:
    """Compare times of which some are censored at one common ``limit``.

    A censored run counts with the limit. So the difference is that of the restricted means; a pair
    of which one run is censored has the right sign and at least its size; a pair of which both are
    is equal. Raises ``ValueError`` as ``paired`` and ``censoring.restricted`` do.
    """
    a, b = (restricted(times, reached, limit)
            for times, reached in ((first, first_reached), (second, second_reached)))
    late, other_late = (~np.asarray(reached, bool) for reached in (first_reached, second_reached))
    return PairedTimes(paired(a, b, level), int((late & other_late).sum()),
                       int((late ^ other_late).sum()))


def holm(p: ArrayLike) -> np.ndarray:
    """p values [m] adjusted so that the chance of any false discovery is bounded (Holm 1979)."""
    raw = _probabilities(p)
    order = np.argsort(raw, kind="stable")
    adjusted = np.empty_like(raw)
    adjusted[order] = np.maximum.accumulate(raw[order] * np.arange(len(raw), 0, -1))
    return np.minimum(adjusted, 1.0)


def _signed_ranks(differences: np.ndarray) -> tuple[float | None, float | None]:
    moved = differences[differences != 0]
    if not len(moved):
        return None, None
    ranks = stats.rankdata(np.abs(moved))
    rank_biserial = float((ranks * np.sign(moved)).sum() / ranks.sum())
    return float(stats.wilcoxon(moved).pvalue), rank_biserial


def _probabilities(p: ArrayLike) -> np.ndarray:
    raw = sample(p)
    if ((raw < 0) | (raw > 1)).any():
        raise ValueError("a p value lies outside [0, 1]")
    return raw
