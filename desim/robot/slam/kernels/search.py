"""Loops of correlative scan matching: all poses in a window are tried, on a coarse grid.

Olson (2009), "Real-time correlative scan matching": for each heading the scan is rotated once, and
then the grid is added up for all translations.
"""

import numpy as np

from desim.ports.kernels import cos, inner, kernel, sin, types
from desim.robot.slam.kernels.alignment import FIT
from desim.robot.slam.kernels.points import X, Y
from desim.robot.slam.kernels.tiles import CELLS, MAPS, OCCUPIED, SIDE

FULL, BESIDE = np.uint8(4), np.uint8(2)  # of a coarse cell with a surface; of one next to it
LANES = 8  # sums that are added up at once, as one vector of int32

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


@inner(types.void(types.uint8[:, ::1], _u8, _u8, types.int32[:, ::1]))
def add_window(grid, row, column, scores):
    """Add the cells of a grid from (row, column) on to ``scores`` [rows, a multiple of LANES].
    Unsigned indices and a fixed number of lanes: it becomes vector instructions."""
    for r in range(np.uint64(scores.shape[0])):
        for first in range(np.uint64(0), np.uint64(scores.shape[1]), np.uint64(LANES)):
            for q in range(first, first + np.uint64(LANES)):
                scores[r, q] += np.int32(grid[row + r, column + q])


@kernel(types.void(_i8, _f8x1, _f8x1, _f8x1, _f8x1, _i8, _f8x2, _i8, MAPS, FIT, _f8, _f8x1))
def search(particle, expected, sigmas, window, start, coarse, points, count, maps, fit, strayed,
           best):
    """Write the best pose [3] of a window around ``start`` to ``best``.

    ``expected`` [3], ``sigmas`` [3]: the pose by odometry, and its standard deviations along the
    robot, across it and of its heading | ``window`` [2]: half its size in m and rad | ``coarse``:
    cells in a step | ``strayed``: the log-likelihood of the odometry counts as ``-strayed`` at
    least, as odometry may fail.
    """
    size_m = coarse * maps.resolution_m
    far, squares = 0.0, 0.0
    for k in range(count):
        squared = points[k, X] * points[k, X] + points[k, Y] * points[k, Y]
        far, squares = max(far, squared), squares + squared
    best[0], best[1], best[2] = start[0], start[1], start[2]
    if count == 0:
        return
    around = int(np.ceil(window[0] / size_m))
    step_rad = size_m / np.sqrt(squares / count)
    turns = int(np.ceil(window[1] / step_rad))
    half = int(np.ceil(np.sqrt(far) / size_m)) + around + 3
    # The grid's middle cell holds the start.
    left = int(np.floor(start[0] / maps.resolution_m)) - maps.left * SIDE - half * coarse
    low = int(np.floor(start[1] / maps.resolution_m)) - maps.low * SIDE - half * coarse
    size, width = 2 * half + 1, 2 * around + 1
    lanes = (width + LANES - 1) // LANES * LANES
    grid = np.empty((size, size + LANES), np.uint8)
    draw_surfaces(particle, left, low, coarse, size, grid, maps)
    from_x = start[0] / maps.resolution_m - maps.left * SIDE - left
    from_y = start[1] / maps.resolution_m - maps.low * SIDE - low
    scores = np.empty((width, lanes), np.int32)
    per_m = 1.0 / maps.resolution_m
    gain = fit.effective * 3.0 / (FULL * count)
    top = -np.inf
    ce, se = cos(expected[2]), sin(expected[2])
    for turn in range(-turns, turns + 1):
        heading = start[2] + turn * step_rad
        c, s = cos(heading), sin(heading)
        scores[:] = 0
        for k in range(count):
            column = int((from_x + (c * points[k, X] - s * points[k, Y]) * per_m) / coarse) - around
            row = int((from_y + (s * points[k, X] + c * points[k, Y]) * per_m) / coarse) - around
            add_window(grid, np.uint64(row), np.uint64(column), scores)
        for r in range(width):
            for q in range(width):
                if gain * scores[r, q] <= top:  # odometry only takes from it
                    continue
                x = start[0] + (q - around) * size_m
                y = start[1] + (r - around) * size_m
                dx, dy, dt = x - expected[0], y - expected[1], heading - expected[2]
                along, across = (ce * dx + se * dy) / sigmas[0], (ce * dy - se * dx) / sigmas[1]
                dt /= sigmas[2]
                off = 0.5 * (along * along + across * across + dt * dt)
                score = gain * scores[r, q] - min(off, strayed)
                if score > top:
                    top = score
                    best[0], best[1], best[2] = x, y, heading
