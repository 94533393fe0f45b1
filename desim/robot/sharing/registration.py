"""Map-to-map registration: finds a teammate's frame in one's own, by their two maps alone.

Rotations come from the Hough spectra of both maps' walls (Carpin 2008: Fast and accurate map
merging for multi-robot systems), translations from the cross-correlation of walls and free cells
for each of these rotations, in place of Carpin's spectra along x and y, in which the walls of one
maze look like any other's. The best few are refined by a search around them (Olson 2009), and
judged by the agreement of what both maps know (Birk and Carpin 2006: Merging occupancy grid maps
from multiple robots, the acceptance indicator). Here the agreement is that of walls: free cells
agree in any two mazes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from desim.robot.sharing.kernels.registration import overlay
from desim.robot.transforms import motion_between

# All of these are ours, and were not varied one by one. docs/map-sharing.md has trials of those
# settings that are keys of a scenario.
_BINS = 360  # of a Hough spectrum, half a degree each
_COARSE = 2  # cells of the map along one of the correlation: 0.4 m
_ROTATIONS = 2  # peaks of the spectra's correlation; each also counts half a turn on
_PLACES = 3  # the best translations of each rotation
# Two hypotheses that are farther apart than this are not the same.
_APART_M = 1.5
_APART_RAD = 0.1
_MOST = 1500  # wall cells in a search; of more, every second, third, ...
# Searches round a hypothesis: (half width in steps, step) of rotation in rad and of both
# translations in cells.
_ROUNDS = (((4, 0.005), (2, 1.0)), ((3, 0.00125), (2, 0.25)))


class TrinaryMap(NamedTuple):
    """A map in its robot's frame: int8 ``state`` [rows, columns], 1 wall, -1 free, 0 unknown;
    the corner of cell 0, 0 is at ``left_m``, ``low_m``."""

    left_m: float
    low_m: float
    cell_m: float
    state: np.ndarray

    def points(self, cells: np.ndarray) -> np.ndarray:
        """[n, 2] m: the centres of the cells that are true in ``cells``."""
        rows, columns = np.nonzero(cells)
        return np.column_stack((self.left_m + self.cell_m * (columns + 0.5),
                                self.low_m + self.cell_m * (rows + 0.5)))


class Hypothesis(NamedTuple):
    """A candidate for ``frame`` [3], the other's frame in one's own, and its evidence: of the wall
    cells of either map that lie on known cells of the other, ``agree`` lie on walls or beside one,
    ``differ`` on other free cells."""

    frame: np.ndarray
    agree: int
    differ: int

    @property
    def confidence(self) -> float:
        """The share that agrees: the acceptance indicator, of walls."""
        return self.agree / max(self.agree + self.differ, 1)


class Registration(NamedTuple):
    """The best hypothesis, and the evidence for the best other one as a share of its own."""

    best: Hypothesis
    rival: float


def register(own: TrinaryMap, other: TrinaryMap) -> Registration | None:
    """The frame of ``other`` in that of ``own``; None where one of the maps has no walls."""
    own_walls, walls = (one.points(one.state > 0) for one in (own, other))
    if not len(own_walls) or not len(walls):
        return None
    found = [refined(own, other, frame) for turn_rad in rotations(own_walls, walls, own.cell_m)
             for frame in _places(own, other, turn_rad)]
    found.sort(key=lambda one: one.differ - one.agree)  # stable: in the order of rotations
    best = found[0]
    weights = [one.agree - one.differ for one in found if _is_another(one.frame, best.frame)]
    return Registration(best, max(weights, default=0) / max(best.agree - best.differ, 1))


def refined(own: TrinaryMap, other: TrinaryMap, frame: np.ndarray) -> Hypothesis:
    """The best hypothesis around ``frame``, by the searches of ``_ROUNDS``."""
    field = _field(own)
    points = other.points(other.state > 0)
    points = points[::-(-len(points) // _MOST)]
    for (turns, turn_rad), (steps, cells) in _ROUNDS:
        shifts = cells * np.arange(-steps, steps + 1)
        scores = np.empty((len(shifts), len(shifts)), np.int64)
        most, best = -math.inf, frame
        for k in sorted(range(-turns, turns + 1), key=abs):  # of equals the smallest change
            turned = np.array([frame[0], frame[1], frame[2] + k * turn_rad])
            x, y = _cells(own, _moved(points, turned))
            overlay(field, x, y, shifts, scores)
            row, column = np.unravel_index(np.argmax(scores), scores.shape)
            if scores[row, column] > most:
                most, best = scores[row, column], turned + own.cell_m * np.array(
                    [shifts[column], shifts[row], 0.0])
        frame = best
    return judged(own, other, frame)


def judged(own: TrinaryMap, other: TrinaryMap, frame: np.ndarray) -> Hypothesis:
    """The agreement of both maps if ``frame`` is the other's frame."""
    agree = differ = 0
    for one, two, where in ((own, other, frame),
                            (other, own, motion_between(frame, np.zeros(3)))):
        points = _moved(two.points(two.state > 0), where)
        marks = _at(one, _near_walls(one), points)
        agree += int(np.count_nonzero(marks > 0))
        differ += int(np.count_nonzero(marks < 0))
    return Hypothesis(frame, agree, differ)


def rotations(own: np.ndarray, other: np.ndarray, cell_m: float) -> list[float]:
    """The turns (rad) of ``other``'s frame at which the spectra of two sets of wall points [n, 2]
    agree best, best first. Spectra are the same after half a turn, so each comes with that."""
    spectra = [np.fft.rfft(_spectrum(points, cell_m)) for points in (own, other)]
    likeness = np.fft.irfft(spectra[0] * np.conj(spectra[1]), _BINS)
    peaks = np.flatnonzero((likeness >= np.roll(likeness, 1)) & (likeness > np.roll(likeness, -1)))
    order = peaks[np.argsort(-likeness[peaks], kind="stable")][:_ROTATIONS]
    turns = [math.pi * int(peak) / _BINS for peak in order]
    return [turn + half for turn in turns for half in (0.0, math.pi)]


def _spectrum(points: np.ndarray, cell_m: float) -> np.ndarray:
    """[bins] the Hough spectrum of points: the sum of squares over all lines of a direction."""
    points = points - points.mean(axis=0)
    reach = math.ceil(np.abs(points).sum(axis=1).max() / cell_m) + 1
    spectrum = np.empty(_BINS)
    for k in range(_BINS):
        angle_rad = math.pi * k / _BINS
        rho = points[:, 0] * math.cos(angle_rad) + points[:, 1] * math.sin(angle_rad)
        lines = np.bincount(np.floor(rho / cell_m).astype(np.int64) + reach)
        spectrum[k] = lines @ lines
    return spectrum


def _places(own: TrinaryMap, other: TrinaryMap, turn_rad: float) -> list[np.ndarray]:
    """The best frames of ``other`` with this turn, by the correlation of walls and free cells."""
    turn = np.array([0.0, 0.0, turn_rad])
    step_m = _COARSE * own.cell_m
    own_walls, own_free = own.points(own.state > 0), own.points(_open(own))
    walls, free = (_moved(other.points(cells), turn) for cells in (other.state > 0, _open(other)))
    low = [np.floor(np.concatenate(points).min(axis=0) / step_m).astype(np.int64) - 1
           for points in ((own_walls, own_free), (walls, free))]
    high = [np.ceil(np.concatenate(points).max(axis=0) / step_m).astype(np.int64) + 2
            for points in ((own_walls, own_free), (walls, free))]
    sides = [_good_size(int(side)) for side in (high[0] - low[0]) + (high[1] - low[1])]

    def image(points: np.ndarray, corner: np.ndarray) -> np.ndarray:
        cells = np.zeros((sides[1], sides[0]))
        columns, rows = (np.floor(points / step_m).astype(np.int64) - corner).T
        cells[rows, columns] = 1.0
        return cells

    place = image(own_walls, low[0])
    about = _dilated(place)
    seen = image(own_free, low[0]) * (1.0 - about)
    theirs, theirs_free = image(walls, low[1]), image(free, low[1])
    theirs_free *= 1.0 - theirs
    product = (np.fft.rfft2(about - seen) * np.conj(np.fft.rfft2(theirs))
               - np.fft.rfft2(place) * np.conj(np.fft.rfft2(theirs_free)))
    scores = np.rint(np.fft.irfft2(product, place.shape))  # counts: whole numbers
    frames = []
    for _ in range(_PLACES):
        row, column = np.unravel_index(np.argmax(scores), scores.shape)
        up, right = (int(number) - side if number > side // 2 else int(number)
                     for number, side in ((row, sides[1]), (column, sides[0])))
        shift_m = step_m * (np.array([right, up]) + low[0] - low[1])
        frames.append(np.array([*shift_m.tolist(), turn_rad]))
        radius = math.ceil(_APART_M / step_m)
        rows, columns = ((np.arange(-radius, radius + 1) + number) % side
                         for number, side in ((row, sides[1]), (column, sides[0])))
        scores[np.ix_(rows, columns)] = -math.inf
    return frames


def _is_another(one: np.ndarray, two: np.ndarray) -> bool:
    """Whether two frames differ by more than noise."""
    return (math.dist(one[:2], two[:2]) >= _APART_M
            or abs(math.remainder(one[2] - two[2], math.tau)) >= _APART_RAD)


def _moved(points: np.ndarray, frame: np.ndarray) -> np.ndarray:
    """Points [n, 2] of ``frame``, as seen from outside of it."""
    cos, sin = math.cos(frame[2]), math.sin(frame[2])
    x_m, y_m = points[:, 0], points[:, 1]
    return np.column_stack((frame[0] + cos * x_m - sin * y_m, frame[1] + sin * x_m + cos * y_m))


def _dilated(cells: np.ndarray) -> np.ndarray:
    """Each cell as the largest of itself and its eight neighbours."""
    wide = np.pad(cells, 1)
    rows = np.maximum(np.maximum(wide[:-2], wide[1:-1]), wide[2:])
    return np.maximum(np.maximum(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:])


def _open(one: TrinaryMap) -> np.ndarray:
    """bool: the free cells that have no wall beside them."""
    return (one.state < 0) & (_dilated((one.state > 0).astype(np.int8)) == 0)


def _near_walls(one: TrinaryMap) -> np.ndarray:
    """int8: 1 on walls and beside them, as far as these cells are known; -1 on other free ones."""
    near = _dilated((one.state > 0).astype(np.int8)) > 0
    return np.where(near, 1, np.minimum(one.state, 0)).astype(np.int8)


def _field(one: TrinaryMap) -> np.ndarray:
    """int8: 2 on walls, 1 beside them, -1 on other free cells."""
    return _near_walls(one) + (one.state > 0)


def _at(one: TrinaryMap, values: np.ndarray, points: np.ndarray) -> np.ndarray:
    """The ``values`` of a map's cells at points [n, 2]; 0 beyond it."""
    columns, rows = (np.floor(place).astype(np.int64) for place in _cells(one, points))
    height, width = values.shape
    inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    return np.where(inside, values[rows * inside, columns * inside], 0)


def _cells(one: TrinaryMap, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Column and row of points [n, 2], not rounded."""
    return ((points[:, 0] - one.left_m) / one.cell_m,
            (points[:, 1] - one.low_m) / one.cell_m)


def _good_size(least: int) -> int:
    """The least size from ``least`` on without other prime factors than 2 and 3, for FFTs."""
    size = least
    while True:
        rest = size
        for factor in (2, 3):
            while rest % factor == 0:
                rest //= factor
        if rest == 1:
            return size
        size += 1
