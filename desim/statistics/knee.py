"""Where a metric over a load or a bandwidth bends: the knee of saturation.

``breakpoint_of`` is the answer: it has an interval, and says that there is no knee where a straight
line does as well. ``kneedle`` finds the point of a curve that is farthest from its chord, on a
straight line with noise, too; it is what the literature of systems uses.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from desim.statistics.samples import aligned
from desim.streams import Streams

_GRID = 401  # places tried: steps of 1/400 of the way between the second and the last load but one


class Knee(NamedTuple):
    """Two straight lines that meet ``at`` a load, with its interval, all in the load's unit.

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
                  seed: int = 0, resamples: int = 1999) -> Knee | None:
    """The knee of ``metric`` [n] over ``load`` [n], one point a run, or None where a straight line
    does as well; in log10 of the load if ``log``.

    Least squares of y = a + b x + c max(0, x - k), k tried on a grid (Quandt 1958; Hinkley 1969).
    None unless sup F, the largest F of any k, is significant at 1 - level. Its distribution under
    a straight line is no F, as k means nothing there (Davies 1977), so it is that of a wild
    bootstrap (Liu 1988) around the line: each residual with a random sign, which lets the points
    scatter more at one load than at another. The bounds of k are percentiles of a wild bootstrap
    around the bent line. Both take the points for independent: under common random numbers, where
    what a seed adds is in all of its points, the bounds are rather too wide.

    Raises ``ValueError`` for fewer than 5 different loads, or, if ``log``, one that is not above
    zero.
    """
    points, y = aligned(load, metric)
    x = _axis(points, log)
    loads = np.unique(x)
    if len(loads) < 5:
        raise ValueError(f"a knee wants at least 5 different loads, got {len(loads)}")
    places = np.union1d(np.linspace(loads[1], loads[-2], _GRID), loads[1:-1])
    line = np.linalg.qr(np.stack([np.ones_like(x), x], axis=1))[0]
    hinges = np.maximum(0.0, x - places[:, None])
    # What a hinge adds to a line lowers the squares by the projection on its own direction.
    own = hinges - hinges @ line @ line.T
    own /= np.linalg.norm(own, axis=1)[:, None]

    draw = Streams(seed)("statistics", "knee")
    signs = 2.0 * draw.integers(0, 2, (resamples, len(x))) - 1.0
    straight = line @ (line.T @ y)
    best = int(np.argmax((own @ y)**2))
    strength = _strengths(own, line, y[None, :])[0]
    others = _strengths(own, line, straight + signs * (y - straight))
    p = (1 + int((others >= strength).sum())) / (resamples + 1)
    if not strength > 0 or p > 1 - level:
        return None

    bent = straight + own[best] * (own[best] @ y)
    tries = bent + signs * (y - bent)
    found = places[np.argmax((tries @ own.T)**2, axis=1)]
    tail = (1 - level) / 2
    at, low, high = places[best], *np.quantile(found, [tail, 1 - tail])
    _, before, change = np.linalg.lstsq(
        np.stack([np.ones_like(x), x, hinges[best]], axis=1), y, rcond=None)[0]
    at, low, high = (10.0**place if log else place for place in (at, low, high))
    return Knee(float(at), float(low), float(high), float(before), float(before + change), p,
                len(x))


def kneedle(load: ArrayLike, metric: ArrayLike, log: bool = False,
            sensitivity: float = 1.0) -> float | None:
    """The first knee, or elbow, of the curve of mean ``metric`` over ``load``, at one of the loads,
    as Kneedle finds it offline (Satopaa et al. 2011, without their smoothing spline), or None.

    Curve and load are scaled to [0, 1] and turned such that the curve rises and bends down. A knee
    is a local maximum of y - x from which it falls by more than ``sensitivity`` mean steps of x
    before it rises again. Raises ``ValueError`` for a load that is not above zero, if ``log``.
    """
    points, y = aligned(load, metric)
    loads, which = np.unique(points, return_inverse=True)
    x = _axis(loads, log)
    y = np.bincount(which, y) / np.bincount(which)
    if len(x) < 3 or np.ptp(y) == 0.0:
        return None
    across, up = (x - x[0]) / np.ptp(x), (y - y.min()) / np.ptp(y)
    if y[-1] < y[0]:
        up = 1.0 - up  # a falling curve that bends up becomes a rising one that bends down
    turned = np.mean(up - across) < 0
    above = across - up if turned else up - across
    fall = sensitivity * np.diff(across).mean()
    peak = None
    for i in range(1, len(x)):
        if peak is not None and above[i] < above[peak] - fall:
            return float(loads[peak])
        if i + 1 < len(x):
            if above[i - 1] < above[i] >= above[i + 1]:
                peak = i
            elif above[i - 1] > above[i] < above[i + 1]:
                peak = None
    return None


def _axis(loads: np.ndarray, log: bool) -> np.ndarray:
    if not log:
        return loads
    if (loads <= 0).any():
        raise ValueError("a load that is not above zero has no logarithm")
    return np.log10(loads)


def _strengths(own: np.ndarray, line: np.ndarray, y: np.ndarray) -> np.ndarray:
    """sup F of each row of ``y`` [k, n], but for the factor (n - 4) / 2 that all of them share."""
    left = y - y @ line @ line.T
    straight = (left**2).sum(axis=1)
    gained = ((left @ own.T)**2).max(axis=1)
    # Less than rounding leaves of numbers as large as y is nothing.
    floor = 1e-24 * (y**2).sum(axis=1) + np.finfo(float).tiny
    return np.where(straight <= floor, 0.0, gained / np.maximum(straight - gained, floor))
