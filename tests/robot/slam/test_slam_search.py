"""The search finds the pose that plain enumeration of its window finds."""

import math
from functools import cache

import numpy as np
import pytest

from desim.robot.slam.kernels.alignment import Fit
from desim.robot.slam.kernels.search import BESIDE, FULL, search
from desim.robot.slam.kernels.tiles import OCCUPIED
from desim.robot.slam.shared_maps import SharedMaps

CELL_M, STRAYED = 0.2, 6.0
FIT = Fit(0.02, 0.05, 0.3, 60.0, 10)
SIGMAS = np.array((0.1, 0.12, 0.05))
POINTS = np.array([(x, 1.1 + 0.01 * x, 0.0, -1.0) for x in np.arange(-3.0, 3.0, 0.23)]
                  + [(2.9, y, -1.0, 0.0) for y in np.arange(-1.5, 1.1, 0.21)])


@cache
def room():
    """The map of a corner, drawn from the origin."""
    maps = SharedMaps(1, CELL_M)
    for _ in range(3):
        maps.add(np.zeros((1, 3)), (0.0, 0.0), POINTS, POINTS)
    return maps


def plain(expected, window, odometry=1.0):
    """The best pose around ``expected``, all in the window tried one by one."""
    visits, hits, corner_m = room().counts(0)
    rows, columns = np.nonzero((hits > 0) & (hits >= OCCUPIED * visits))
    score_of = {}
    for value, reach in (BESIDE, 1), (FULL, 0):
        for row, column in zip(rows.tolist(), columns.tolist(), strict=True):
            score_of |= {(row + r, column + c): int(value) for r in range(-reach, reach + 1)
                         for c in range(-reach, reach + 1)}
    step_rad = CELL_M / math.sqrt((POINTS[:, :2] ** 2).sum(1).mean())
    around, turns = math.ceil(window[0] / CELL_M), math.ceil(window[1] / step_rad)
    x_m, y_m, yaw_rad = expected.tolist()
    best, top = None, -math.inf
    for turn in range(-turns, turns + 1):
        heading = yaw_rad + turn * step_rad
        c, s = math.cos(heading), math.sin(heading)
        seen_x_m = c * POINTS[:, 0] - s * POINTS[:, 1]
        seen_y_m = s * POINTS[:, 0] + c * POINTS[:, 1]
        column = np.floor((x_m + seen_x_m - corner_m[0]) / CELL_M).astype(int)
        row = np.floor((y_m + seen_y_m - corner_m[1]) / CELL_M).astype(int)
        for up in range(-around, around + 1):
            for right in range(-around, around + 1):
                fit = sum(score_of.get((r + up, k + right), 0)
                          for r, k in zip(row.tolist(), column.tolist(), strict=True))
                dx, dy = right * CELL_M, up * CELL_M
                along = (math.cos(yaw_rad) * dx + math.sin(yaw_rad) * dy) / SIGMAS[0]
                across = (math.cos(yaw_rad) * dy - math.sin(yaw_rad) * dx) / SIGMAS[1]
                off = 0.5 * (along ** 2 + across ** 2 + (turn * step_rad / SIGMAS[2]) ** 2)
                score = (FIT.effective * 3.0 / (FULL * len(POINTS)) * fit
                         - odometry * min(off, STRAYED))
                if score > top:
                    best, top = (x_m + dx, y_m + dy, heading), score
    return best


def found(expected, window):
    best = np.empty(3)
    search(0, expected, SIGMAS, np.array(window), 1, POINTS, len(POINTS), room().arrays,
           FIT, STRAYED, best)
    return best


# The widths of the windows: 7, 9 and 11 cells.
CASES = [((0.31, -0.17, 0.08), (0.5, 0.3)), ((-0.22, 0.35, -0.11), (0.8, 0.3)),
         ((0.83, 0.05, 0.13), (1.0, 0.3))]


@pytest.mark.parametrize(("expected", "window"), CASES)
def test_the_search_finds_what_enumeration_finds(expected, window):
    expected = np.array(expected)
    assert found(expected, window) == pytest.approx(plain(expected, window), abs=1e-9)


def test_but_not_where_the_odometry_counts_for_more():
    expected, window = np.array(CASES[0][0]), CASES[0][1]
    assert found(expected, window) != pytest.approx(plain(expected, window, 100.0), abs=1e-9)
