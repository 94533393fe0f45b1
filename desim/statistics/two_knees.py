"""Two knees of one curve: where a metric leaves its first plateau, and where it reaches its second.

A network that is starved to the end cannot get worse: times stand at their limit, shares near 0.
A single knee would be placed somewhere between the two that such a curve has.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from desim.engine.streams import Streams
from desim.statistics.knee import Knee, breakpoint_of, prepared

FEWEST_LOADS = 7  # three lines that meet have six parameters
_GRID = 81  # places tried, of which all pairs
_CELLS = 400_000  # samples times pairs held at a time: 3 MB


def knees_of(load: ArrayLike, metric: ArrayLike, log: bool = False, level: float = 0.95,
             seed: int = 0, resamples: int = 1999, blocks: ArrayLike | None = None,
             ) -> tuple[Knee, ...]:
    """The knees in ascending order: none, the one of ``breakpoint_of``, or two where three straight
    lines that meet do significantly better than two (sequential tests, as Bai and Perron 1998).
    A curve with two similar bends may look straight to a single one: where there is none, three
    lines are tested against one, at half the error.

    Arguments and errors are those of ``breakpoint_of``. ``p`` of two knees: that the fewer lines
    would leave so much more, by a wild bootstrap around them. The bounds of a knee hold every place
    at which, wherever the other one lies, three lines are not significantly worse.
    """
    one = breakpoint_of(load, metric, log, level, seed, resamples, blocks)
    fewer = () if one is None else (one,)
    if len(np.unique(np.asarray(load))) < FEWEST_LOADS:
        return fewer
    x, y = prepared(load, metric, log, blocks)
    fits = _Pairs(x)
    draw = Streams(seed)("statistics", "bends")
    signs = 2.0 * draw.integers(0, 2, (resamples, len(x))) - 1.0

    sums, squares = fits.parts(y[None, :])
    bent, leverage = fits.fit(y, *(fits.best_of_one(sums) if one else ()))
    strength = fits.strengths(sums, squares, bool(one))[0]
    chance = fits.strengths(*fits.parts(bent + signs * (y - bent) / (1 - leverage)), bool(one))
    p = (1 + int((chance >= strength).sum())) / (resamples + 1)
    if not strength > 0 or p > (1 - level) / (1 if one else 2):
        return fewer

    gained = fits.of_two(sums)[0]
    best = int(np.argmax(gained))
    pair = fits.first[best], fits.second[best]
    bent, leverage = fits.fit(y, *pair)
    left = max(((y - bent)**2).sum(), np.finfo(float).tiny)
    sums, squares = fits.parts(bent + signs * (y - bent) / (1 - leverage))
    most, *most_at = fits.most_of_two(sums, fits.first == pair[0], fits.second == pair[1])
    left_over = np.maximum(squares - most, np.finfo(float).tiny)
    slopes = fits.slopes(y, *pair)
    found = []
    for which, (ends, place) in enumerate(zip((fits.first, fits.second), pair, strict=True)):
        excess = (most - most_at[which]) / left_over
        enough = gained[best] - np.quantile(excess, level) * left
        held = np.unique(ends[gained >= enough])
        # The first places that are not held, as the bounds lie before them.
        at = fits.places[[place, max(held[0] - 1, 0), min(held[-1] + 1, len(fits.places) - 1)]]
        middle, low, high = (float(10.0**value if log else value) for value in at)
        found.append(Knee(middle, low, high, slopes[which], slopes[which + 1], p, len(x)))
    return tuple(found)


class _Pairs:
    """Lines with one bend or two through points at ``x`` [n], ascending, for many y at once.

    All is done with the sums [m, l] over the points of each of l loads, as a fit is the same at all
    of them. ``first`` and ``second`` [p] index ``places``: bends with at least one load between
    them or on them, so that the middle line is one.
    """

    def __init__(self, x: np.ndarray) -> None:
        loads, self._begins, counts = np.unique(x, return_index=True, return_counts=True)
        self._x = x
        self.places = np.union1d(np.linspace(loads[1], loads[-2], _GRID), loads[1:-1])
        self._root = np.sqrt(counts)
        line = np.linalg.qr(np.stack([np.ones_like(loads), loads], axis=1)
                            * self._root[:, None])[0]
        hinges = np.maximum(0.0, loads - self.places[:, None]) * self._root
        self._line, self._one = line, _unit(hinges - hinges @ line @ line.T)
        first, second = np.triu_indices(len(self.places), 1)
        apart = np.searchsorted(loads, self.places[second], "right") \
            > np.searchsorted(loads, self.places[first], "left")
        self.first, self.second = first[apart], second[apart]
        self._shared = (self._one @ self._one.T)[self.first, self.second]
        self._own = 1.0 - self._shared**2

    def parts(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The weighted sums by load [m, l] of each row of ``y`` [m, n], and the squares [m] that a
        straight line leaves."""
        sums = np.add.reduceat(y, self._begins, axis=1) / self._root
        return sums, (y**2).sum(axis=1) - ((sums @ self._line)**2).sum(axis=1)

    def best_of_one(self, sums: np.ndarray) -> np.ndarray:
        """The place [m] of the best single bend."""
        return ((sums @ self._one.T)**2).argmax(axis=1)

    def of_two(self, sums: np.ndarray) -> np.ndarray:
        """The decrease of the squares [m, p] by each pair: by the first bend alone, and by the part
        of the second one that is not along the first (Gram and Schmidt)."""
        along = sums @ self._one.T
        first, second = along[:, self.first], along[:, self.second]
        return first**2 + (second - self._shared * first)**2 / self._own

    def most_of_two(self, sums: np.ndarray, *among: np.ndarray) -> np.ndarray:
        """The greatest decrease of the squares of each row [m] by any pair, then by the pairs in
        each mask of ``among`` [p]: [1 + masks, m]."""
        step = max(_CELLS // len(self.first), 1)
        found = []
        for begin in range(0, len(sums), step):
            gained = self.of_two(sums[begin:begin + step])
            found.append([gained.max(axis=1), *(gained[:, pairs].max(axis=1) for pairs in among)])
        return np.concatenate(found, axis=1)

    def strengths(self, sums: np.ndarray, squares: np.ndarray, of_second: bool) -> np.ndarray:
        """sup F [m] of a second bend, or of both, but for a factor that all share."""
        single = ((sums @ self._one.T)**2).max(axis=1) if of_second else 0.0
        double = self.most_of_two(sums)[0]
        floor = 1e-12 * np.maximum(squares, 0.0) + np.finfo(float).tiny
        return np.where(squares > 1e-24 * (sums**2).sum(axis=1),
                        (double - single) / np.maximum(squares - double, floor), 0.0)

    def fit(self, y: np.ndarray, *places: int) -> tuple[np.ndarray, np.ndarray]:
        """The lines [n] that bend at ``places``, and the leverage of each point on them, below 1
        (MacKinnon, White 1985)."""
        basis = np.linalg.qr(self._columns(*places))[0]
        return basis @ (basis.T @ y), np.minimum((basis**2).sum(axis=1), 0.99)

    def slopes(self, y: np.ndarray, *places: int) -> list[float]:
        """The slopes of the lines that bend at ``places``, from the lowest load."""
        found = np.linalg.lstsq(self._columns(*places), y, rcond=None)[0]
        return np.cumsum(found[1:]).tolist()

    def _columns(self, *places: int) -> np.ndarray:
        x = self._x
        return np.stack([np.ones_like(x), x, *(np.maximum(0.0, x - self.places[place])
                                               for place in places)], axis=1)


def _unit(rows: np.ndarray) -> np.ndarray:
    return rows / np.linalg.norm(rows, axis=1)[:, None]
