"""Loops of correlative scan matching: all poses in a window are tried, on a coarse grid.

Olson (2009), "Real-time correlative scan matching": for each heading the scan is rotated once, and
then the grid is added up for all translations.
"""

from typing import NamedTuple

import numpy as np

from desim.ports.kernels import cos, inner, kernel, sin, types
from desim.robot.slam.kernels.alignment import FIT
from desim.robot.slam.kernels.points import X, Y
from desim.robot.slam.kernels.tiles import CELLS, MAPS, OCCUPIED, SIDE

FULL, BESIDE = np.uint8(2), np.uint8(1)  # of a coarse cell with a surface; of one next to it
LANES = 8  # sums that are added up at once, as one vector of uint16
MOST = 32_767  # returns at most: their sums are below 2^16

_f8, _i8, _f8x1, _f8x2 = types.float64, types.int64, types.float64[::1], types.float64[:, ::1]
_u8 = types.uint64


@kernel(types.void(_i8, _i8, _i8, _i8, _i8, types.uint8[:, ::1], MAPS), inner=True)
def draw_surfaces(particle, left, low, coarse, columns, grid, maps):
    """Mark the coarse cells (``coarse`` cells wide) with occupied cells, and those beside them, in
    the first ``columns`` of the grid. ``left``, ``low``: its first cell."""
    rows = grid.shape[0]
    grid[:] = 0
    tiles_up = maps.visit_tiles.shape[1] // maps.columns
    for up in range(max(low >> 3, 0), min(((low + rows * coarse) >> 3) + 1, tiles_up)):
        for right in range(max(left >> 3, 0), min(((left + columns * coarse) >> 3) + 1,
                                                  maps.columns)):
            hit_tile = maps.hit_tiles[particle, up * maps.columns + right]
            if hit_tile == 0:
                continue
            visit_tile = maps.visit_tiles[particle, up * maps.columns + right]
            for cell in range(CELLS):
                hits = maps.hits[hit_tile, cell]
                if hits == 0 or hits < OCCUPIED * maps.visits[visit_tile, cell]:
                    continue
                row = (up * SIDE + (cell >> 3) - low) // coarse
                column = (right * SIDE + (cell & 7) - left) // coarse
                if 0 < row < rows - 1 and 0 < column < columns - 1:
                    for r in range(row - 1, row + 2):
                        for c in range(column - 1, column + 2):
                            grid[r, c] = max(grid[r, c], BESIDE)
                    grid[row, column] = FULL


@inner(types.void(types.uint8[:, ::1], _u8, _u8, types.uint16[:, ::1]))
def add_window(grid, row, column, scores):
    """Add the cells of a grid from (row, column) on to ``scores`` [rows, a multiple of LANES].
    Unsigned indices and a fixed number of lanes: it becomes vector instructions."""
    for r in range(np.uint64(scores.shape[0])):
        for first in range(np.uint64(0), np.uint64(scores.shape[1]), np.uint64(LANES)):
            for q in range(first, first + np.uint64(LANES)):
                scores[r, q] += np.uint16(grid[row + r, column + q])


@kernel(types.uint16[:, ::1](_i8), inner=True)
def scores_of(around):
    """Zeros for all translations by up to ``around`` cells."""
    width = 2 * around + 1
    return np.zeros((width, (width + LANES - 1) // LANES * LANES), np.uint16)


class Grid(NamedTuple):
    """Surfaces around a pose: ``cells`` [rows, columns] of uint8, the place of that pose in cells
    of the map from the first one on, the width of one in cells of the map, and their number in a
    metre."""

    cells: np.ndarray
    from_x: float
    from_y: float
    coarse: int
    per_m: float


GRID = types.NamedTuple([types.uint8[:, ::1], _f8, _f8, _i8, _f8], Grid)


@inner(types.void(GRID, _f8, _f8x2, _i8, _i8, types.uint16[:, ::1]))
def add_up(grid, heading, points, count, around, scores):
    """Write the sums of the cells that a scan's returns meet at a heading to ``scores``: for all
    translations by up to ``around`` cells."""
    c, s = cos(heading), sin(heading)
    scores[:] = 0
    for k in range(count):
        x, y = points[k, X], points[k, Y]
        column = int((grid.from_x + (c * x - s * y) * grid.per_m) / grid.coarse) - around
        row = int((grid.from_y + (s * x + c * y) * grid.per_m) / grid.coarse) - around
        add_window(grid.cells, np.uint64(row), np.uint64(column), scores)


@inner(types.void(GRID, _f8x1, _f8x1, _f8, _i8, _f8, _f8, _f8x2, _i8, _f8, types.uint16[:, ::1],
                  _f8x1))
def enumerate_poses(grid, expected, sigmas, size_m, turns, step_rad, gain, points, count, strayed,
                    scores, best):
    """Write the best of all poses to ``best``: of so many ``turns`` of ``step_rad`` to each side,
    and of the translations in ``scores``. ``gain``: the log-likelihood of a cell's worth."""
    around, top = scores.shape[0] // 2, -np.inf
    c, s = cos(expected[2]), sin(expected[2])
    for turn in range(-turns, turns + 1):
        heading = expected[2] + turn * step_rad
        add_up(grid, heading, points, count, around, scores)
        for r in range(2 * around + 1):
            for q in range(2 * around + 1):
                if gain * scores[r, q] <= top:  # odometry only takes from it
                    continue
                x = expected[0] + (q - around) * size_m
                y = expected[1] + (r - around) * size_m
                dx, dy, dt = x - expected[0], y - expected[1], heading - expected[2]
                along, across = (c * dx + s * dy) / sigmas[0], (c * dy - s * dx) / sigmas[1]
                dt /= sigmas[2]
                off = 0.5 * (along * along + across * across + dt * dt)
                score = gain * scores[r, q] - min(off, strayed)
                if score > top:
                    top = score
                    best[0], best[1], best[2] = x, y, heading


@kernel(types.void(_i8, _f8x1, _f8x1, _f8x1, _i8, _f8x2, _i8, MAPS, FIT, _f8, _f8x1))
def search(particle, expected, sigmas, window, coarse, points, count, maps, fit, strayed, best):
    """Write the best pose [3] of a window around ``expected`` to ``best``.

    ``expected`` [3], ``sigmas`` [3]: the pose by odometry, and its standard deviations along the
    robot, across it and of its heading | ``window`` [2]: half its size in m and rad | ``coarse``:
    cells in a step | ``strayed``: the log-likelihood of the odometry counts as ``-strayed`` at
    least, as odometry may fail.

    Poses that are so far off that they would lose even if all returns met a surface there are left
    out: the odometry takes more from them than the returns miss at the expected pose.
    """
    count, size_m = min(count, MOST), coarse * maps.resolution_m
    far, squares = 0.0, 0.0
    for k in range(count):
        squared = points[k, X] * points[k, X] + points[k, Y] * points[k, Y]
        far, squares = max(far, squared), squares + squared
    best[0], best[1], best[2] = expected[0], expected[1], expected[2]
    if count == 0:
        return
    around = int(np.ceil(window[0] / size_m))
    step_rad = size_m / np.sqrt(squares / count)
    turns = int(np.ceil(window[1] / step_rad))
    half = int(np.ceil(np.sqrt(far) / size_m)) + around + 3
    # The grid's middle cell holds the expected pose.
    at_x = expected[0] / maps.resolution_m - maps.left * SIDE
    at_y = expected[1] / maps.resolution_m - maps.low * SIDE
    left = int(np.floor(expected[0] / maps.resolution_m)) - maps.left * SIDE - half * coarse
    low = int(np.floor(expected[1] / maps.resolution_m)) - maps.low * SIDE - half * coarse
    size = 2 * half + 1
    grid = Grid(np.empty((size, size + LANES), np.uint8), at_x - left, at_y - low, coarse,
                1.0 / maps.resolution_m)
    draw_surfaces(particle, left, low, coarse, size, grid.cells, maps)
    gain, scores = fit.effective * 3.0 / (FULL * count), scores_of(0)
    add_up(grid, expected[2], points, count, 0, scores)
    missed = gain * (FULL * count - scores[0, 0])
    if missed < strayed:  # one step more each, for rounding
        steps = np.sqrt(2.0 * missed)
        turns = min(turns, int(steps * sigmas[2] / step_rad) + 1)
        around = min(around, int(steps * max(sigmas[0], sigmas[1]) / size_m) + 1)
    enumerate_poses(grid, expected, sigmas, size_m, turns, step_rad, gain, points, count, strayed,
                    scores_of(around), best)
