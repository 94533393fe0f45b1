"""The knee of saturation: the bend of a metric over a load or a bandwidth.

``breakpoint_of`` is the answer: it has an interval, and says that there is no knee where a straight
line does as well.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from desim.engine.streams import Streams
from desim.statistics.samples import aligned

FEWEST_LOADS, FEWEST_RUNS = 5, 8  # two lines that meet have four parameters
_GRID = 401  # places tried: steps of 1/400 of the way between the second and the last load but one


class Knee(NamedTuple):
    """Two straight lines that meet ``at`` a load, with its interval, all in the load's unit.

    No knee is sought before the second load or after the last but one: a bound there is open.
    ``slope_before``, ``slope_after``: metric per unit of load, per decade if the fit is in its
    logarithm. ``p``: that one straight line would leave so much more. ``n`` points.
    """

    at: float
    low: float
    high: float
    slope_before: float
    slope_after: float
    p: float
    n: int


def breakpoint_of(load: ArrayLike, metric: ArrayLike, log: bool = False, level: float = 0.95,
                  seed: int = 0, resamples: int = 1999,
                  blocks: ArrayLike | None = None) -> Knee | None:
    """The knee of ``metric`` [n] over ``load`` [n], one point a run, or None where a straight line
    does as well; in log10 of the load if ``log``. ``blocks`` [n]: under common random numbers, the
    seed of each run; what a seed adds at all loads alike is taken out first.

    Least squares of y = a + b x + c max(0, x - k), k tried on a grid (Quandt 1958; Hinkley 1969).
    None unless sup F, the largest F of any k, is significant at 1 - level. Its distribution under
    a straight line is no F, as k means nothing there (Davies 1977), so it is that of a wild
    bootstrap (Liu 1988) around the line: each residual with a random sign, which lets the points
    scatter more at one load than at another. The bounds hold every k that is not worse than the
    best by more than level of a wild bootstrap around the bent line (Hansen 2017): k itself does
    not vary as its estimate does, which prefers the loads. Both take the points for independent.

    Raises ``ValueError`` for fewer than 5 different loads or 8 runs, for ``blocks`` of which not
    each has one run at each load, and, if ``log``, for a load that is not above zero.
    """
    x, y = prepared(load, metric, log, blocks)
    fits = _Fits(x)
    draw = Streams(seed)("statistics", "knee")
    signs = 2.0 * draw.integers(0, 2, (resamples, len(x))) - 1.0

    straight = fits.straight(y)
    strength = fits.strengths(y[None, :])[0]
    chance = fits.strengths(straight + signs * (y - straight))
    p = (1 + int((chance >= strength).sum())) / (resamples + 1)
    if not strength > 0 or p > 1 - level:
        return None

    gained = fits.gains(y[None, :])[0]
    best = int(np.argmax(gained))
    bent = straight + fits.own[best] * (fits.own[best] @ y)
    # A point that draws the lines to itself leaves less than its scatter (MacKinnon, White 1985).
    residuals = (y - bent) / (1 - fits.leverages(best))
    excess = fits.excesses(bent + signs * residuals, best)
    worse = (gained[best] - gained) / max(((y - bent)**2).sum(), np.finfo(float).tiny)
    held = np.flatnonzero(worse <= np.quantile(excess, level))
    # The first places that are not held, as the bounds lie before them.
    ends = max(held[0] - 1, 0), min(held[-1] + 1, len(worse) - 1)
    bounds = fits.places[[best, *ends]]
    at, low, high = (float(10.0**place if log else place) for place in bounds)
    hinge = np.maximum(0.0, x - fits.places[best])
    _, before, change = np.linalg.lstsq(np.stack([np.ones_like(x), x, hinge], axis=1), y,
                                        rcond=None)[0]
    return Knee(at, low, high, float(before), float(before + change), p, len(x))


def prepared(load: ArrayLike, metric: ArrayLike, log: bool, blocks: ArrayLike | None,
             ) -> tuple[np.ndarray, np.ndarray]:
    """Loads, ascending, in log10 if ``log``, and values [n] without what a block adds to all of
    them; in an order that does not depend on the one given. Raises as ``breakpoint_of``."""
    points, y = aligned(load, metric)
    if blocks is not None:
        y = _without_blocks(points, y, np.asarray(blocks))
    order = np.lexsort((y, points))
    return _axis(points[order], log), y[order]


class _Fits:
    """Straight and bent lines through points at ``x`` [n], ascending, for many y at once.

    ``places`` [k] are tried for the bend. What a hinge at a place adds to a straight line is along
    one direction, a row of ``own`` [k, n], and lowers the sum of squares by the square of y's part
    along it.
    """

    def __init__(self, x: np.ndarray) -> None:
        loads, self._begins = np.unique(x, return_index=True)
        if len(loads) < FEWEST_LOADS or len(x) < FEWEST_RUNS:
            raise ValueError(f"a knee wants at least {FEWEST_LOADS} different loads and "
                             f"{FEWEST_RUNS} runs, got {len(loads)} and {len(x)}")
        self.places = np.union1d(np.linspace(loads[1], loads[-2], _GRID), loads[1:-1])
        self._line = np.linalg.qr(np.stack([np.ones_like(x), x], axis=1))[0]
        hinges = np.maximum(0.0, x - self.places[:, None])
        own = hinges - self.straight(hinges)
        self.own = own / np.linalg.norm(own, axis=1)[:, None]

    def straight(self, y: np.ndarray) -> np.ndarray:
        """The straight line through each row of ``y`` [..., n]."""
        return y @ self._line @ self._line.T

    def leverages(self, place: int) -> np.ndarray:
        """The leverage of each point [n] on the lines that meet at ``place``, below 1."""
        return np.minimum((self._line**2).sum(axis=1) + self.own[place]**2, 0.99)

    def gains(self, y: np.ndarray) -> np.ndarray:
        """The decrease [m, k] of the squares of each row of ``y`` [m, n] by a bend at each place. A
        direction is the same at all points of one load, so that their sum is enough."""
        return (np.add.reduceat(y, self._begins, axis=1) @ self.own[:, self._begins].T)**2

    def excesses(self, y: np.ndarray, place: int) -> np.ndarray:
        """The squares of each row of ``y`` [m, n] that a bend at ``place`` leaves in excess of the
        best bend, as a share of those that the best leaves."""
        left = y - self.straight(y)
        gained = self.gains(left)
        most = gained.max(axis=1)
        left_over = np.maximum((left**2).sum(axis=1) - most, np.finfo(float).tiny)
        return (most - gained[:, place]) / left_over

    def strengths(self, y: np.ndarray) -> np.ndarray:
        """sup F of each row of ``y`` [m, n], but for the factor (n - 4) / 2 that all share."""
        left = y - self.straight(y)
        squares, gained = (left**2).sum(axis=1), self.gains(left).max(axis=1)
        # Less than rounding leaves of numbers as large as these is nothing.
        floor = 1e-24 * (y**2).sum(axis=1) + np.finfo(float).tiny
        return np.where(squares <= floor, 0.0, gained / np.maximum(squares - gained, floor))


def _without_blocks(points: np.ndarray, y: np.ndarray, blocks: np.ndarray) -> np.ndarray:
    """``y`` with the mean of each block moved to the mean of all."""
    if blocks.shape != y.shape:
        raise ValueError(f"{len(y)} runs cannot belong to blocks {blocks.shape}")
    which = np.unique(blocks, return_inverse=True)[1]
    loads, at = np.unique(points, return_inverse=True)
    if (np.bincount(which * len(loads) + at, minlength=(which.max() + 1) * len(loads)) != 1).any():
        raise ValueError("not each block has one run at each load")
    return y - (np.bincount(which, y) / len(loads))[which] + y.mean()


def _axis(loads: np.ndarray, log: bool) -> np.ndarray:
    if not log:
        return loads
    if (loads <= 0).any():
        raise ValueError("a load that is not above zero has no logarithm")
    return np.log10(loads)
