"""Sobol's indices from a Saltelli design: the parameters that make a metric vary."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import qmc

from desim.engine.streams import Streams
from desim.statistics.samples import sample, spread


class SobolIndices(NamedTuple):
    """A parameter's shares of the metric's variance: ``first`` is the share that it explains by
    itself, ``total`` the share in which it has a part, each with its bounds. An estimate near 0 may
    be below it. All None where the metric does not vary."""

    first: float | None
    first_low: float | None
    first_high: float | None
    total: float | None
    total_low: float | None
    total_high: float | None


def saltelli(points: int, dimensions: int, seed: int = 0) -> np.ndarray:
    """The design [points * (dimensions + 2), dimensions] in [0, 1): for each point a row of A, the
    same row with one column after the other taken from B, the row of B (Saltelli et al. 2010). A
    and B are halves of a scrambled Sobol sequence. A beginning of the design is a design, too.

    Raises ``ValueError`` unless ``points`` is a power of two, for which the sequence is balanced.
    """
    if points < 1 or points & (points - 1):
        raise ValueError(f"the number of points must be a power of two, got {points}")
    both = qmc.Sobol(2 * dimensions, seed=Streams(seed)("statistics", "saltelli")).random(points)
    a, b = both[:, :dimensions], both[:, dimensions:]
    rows = np.repeat(a[:, None, :], dimensions + 2, axis=1)
    for i in range(dimensions):
        rows[:, 1 + i, i] = b[:, i]
    rows[:, -1] = b
    return rows.reshape(-1, dimensions)


def indices(values: ArrayLike, dimensions: int, level: float = 0.95, seed: int = 0,
            resamples: int = 1999) -> list[SobolIndices]:
    """The indices of each parameter, from the metric at the rows of ``saltelli``.

    S_i = mean(f(B) (f(A_i) - f(A))) / V (Saltelli et al. 2010, table 2 b) and
    T_i = mean((f(A) - f(A_i))^2) / (2 V) (Jansen 1999), V the variance of f(A) and f(B) together,
    f taken from its mean first, which makes S_i vary less. The bounds are percentiles of a
    bootstrap over the points (Archer et al. 1997). Raises ``ValueError`` if there are not
    (dimensions + 2) values for each of two points or more.
    """
    flat = sample(values)
    if len(flat) % (dimensions + 2) or len(flat) < 2 * (dimensions + 2):
        raise ValueError(f"{len(flat)} values are not {dimensions + 2} for each point")
    if spread(flat, np.abs(flat).max()) == 0.0:
        return [SobolIndices(*[None] * 6)] * dimensions
    f = flat.reshape(-1, dimensions + 2)
    f = f - f[:, [0, -1]].mean()
    a, mixed, b = f[:, :1], f[:, 1:-1], f[:, -1:]
    # Columns whose means are all that the estimators need.
    terms = np.hstack([b * (mixed - a), (a - mixed)**2 / 2, (a + b) / 2, (a**2 + b**2) / 2])
    found = _estimates(terms.mean(axis=0)[None, :], dimensions)[0]
    draw = Streams(seed)("statistics", "sobol bootstrap")
    weights = draw.multinomial(len(f), np.full(len(f), 1 / len(f)), resamples) / len(f)
    tail = (1 - level) / 2
    low, high = np.nanquantile(_estimates(weights @ terms, dimensions), [tail, 1 - tail], axis=0)
    bounds = np.stack([found, low, high], axis=1).reshape(2, dimensions, 3)
    return [SobolIndices(*map(float, bounds[:, i].ravel())) for i in range(dimensions)]


def _estimates(means: np.ndarray, dimensions: int) -> np.ndarray:
    """First-order, then total indices [k, 2 d] of means of terms [k, 2 d + 2]; NaN if V is 0."""
    variance = means[:, -1] - means[:, -2]**2
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(variance > 0, means[:, :2 * dimensions].T / variance, np.nan).T
