"""Whether two ways of measuring rank settings alike, and which pairs of settings change places."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from desim.statistics.comparisons import Paired, holm, paired
from desim.statistics.samples import aligned


class Kendall(NamedTuple):
    """``tau`` in [-1, 1]; ``p`` of no association, two-sided. Of three settings no p is below 1/3,
    of four none below 1/12. None where one of the rankings ties all settings."""

    tau: float | None
    p: float | None


class Flip(NamedTuple):
    """Settings ``i`` < ``j`` stand in opposite order. ``first``, ``second``: i compared with j on
    either side; ``p``: that of the order being different, adjusted; ``significant``: below 1 -
    level."""

    i: int
    j: int
    first: Paired
    second: Paired
    p: float
    significant: bool


def kendall(first: ArrayLike, second: ArrayLike) -> Kendall:
    """Kendall's tau-b (1945), which allows for ties, between what two ways of measuring give for
    the same settings [k]. Exact p for few settings without ties. Raises ``ValueError`` for unequal
    numbers of settings."""
    a, b = aligned(first, second)
    if len(a) < 2 or np.ptp(a) == 0 or np.ptp(b) == 0:
        return Kendall(None, None)
    found = stats.kendalltau(a, b, variant="b")
    return Kendall(float(found.statistic), float(found.pvalue))


def flips(first: ArrayLike, second: ArrayLike, level: float = 0.95) -> list[Flip]:
    """The pairs of settings whose means stand in opposite order, from [settings, seeds] each, with
    the same seeds for all settings (their numbers may differ between first and second).

    A flip is significant if the order is so on both sides: its p is the larger of the two paired
    t tests' (intersection-union test, Berger 1982), adjusted by Holm over all pairs of settings,
    flipped or not. Raises ``ValueError`` for arrays that do not fit.
    """
    a, b = np.asarray(first, float), np.asarray(second, float)
    if a.ndim != 2 or b.ndim != 2 or len(a) != len(b):
        raise ValueError(f"{a.shape} and {b.shape} are not [settings, seeds] of the same settings")
    compared = [(i, j, paired(a[i], a[j], level), paired(b[i], b[j], level))
                for i, j in combinations(range(len(a)), 2)]
    opposite = [_opposite(one, other) for _, _, one, other in compared]
    p = holm([max(_p(one), _p(other)) if turned else 1.0
              for (_, _, one, other), turned in zip(compared, opposite, strict=True)])
    return [Flip(*pair, float(chance), bool(chance < 1 - level))
            for pair, turned, chance in zip(compared, opposite, p, strict=True) if turned]


def _opposite(one: Paired, other: Paired) -> bool:
    return (one.difference.mean or 0.0) * (other.difference.mean or 0.0) < 0


def _p(one: Paired) -> float:
    """The p value; 1 where nothing could be tested."""
    return 1.0 if one.t_p is None else one.t_p
