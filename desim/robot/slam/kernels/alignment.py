"""Loops that align a scan with a particle's map: the pose at which its returns fit best.

The residual of a return is its distance from the surface nearby, along the surface's normal: the
point-to-line metric of Censi (2008), with the surface taken from the cells around. The most likely
pose, given the scan and the odometry, is found by Gauss-Newton steps with weights that fall for
outliers (Geman and McClure 1985); its covariance is the inverse of the information there (Laplace's
approximation).
"""

from typing import NamedTuple

import numpy as np

from desim.ports.kernels import cos, inner, kernel, log, sin, types
from desim.robot.slam.kernels.points import NX, NY, X, Y
from desim.robot.slam.kernels.tiles import MAPS, OCCUPIED, SIDE

# All of these are ours. docs/slam.md has what another value of one makes of a real log's error.
UNKNOWN = -2.0  # log-likelihood of a return in the unknown
MISSED = -3.0  # the least of any return: where no surface is
LOOSE = 0.25  # weight of a return without a normal, in each direction
SAME_SIDE = 0.4  # cosine: surfaces turned farther from each other are not matched
KNOWN_NORMAL = 0.3  # a cell's mean normal is used if it is that long; shorter, they disagree
MOST_HITS = 8.0  # more returns in a cell do not make it count more
GAIN = 0.02  # a step by which the log-likelihood would grow less (0.2 sigma) is the last


class Fit(NamedTuple):
    """The comparison of a scan with a map: ``sigma_m`` standard deviation of a residual,
    ``scale_m`` of the weights for outliers, ``reach_m`` in which cells count, ``effective`` number
    of independent returns in a scan, ``steps`` at most."""

    sigma_m: float
    scale_m: float
    reach_m: float
    effective: float
    steps: int


_f8, _i8, _f8x1, _f8x2 = types.float64, types.int64, types.float64[::1], types.float64[:, ::1]
FIT = types.NamedTuple([_f8, _f8, _f8, _f8, _i8], Fit)


@inner(types.void(_i8, _f8x1, _f8x2, _i8, _f8, MAPS, _f8x2))
def surfaces(particle, pose, points, count, reach_m, maps, near):
    """Write the surface near each return of a scan at ``pose`` to ``near`` [count, 7].

    A row is: the return as seen from the robot (x, y in the map's directions), the offset from it
    to the surface, the surface's normal (zeros if unknown), and 1. The last is 0 if there is no
    surface, and -1 if all cells there are unknown.

    The surface is the mean of the mean returns of 3 x 3 cells, weighted with (1 - d^2 / reach^2)^2
    and their number.
    One call for all returns: a call that hands over the maps costs as much as five cells.
    """
    c, s = cos(pose[2]), sin(pose[2])
    cell_m, per_m, far = maps.resolution_m, 1.0 / maps.resolution_m, 1.0 / (reach_m * reach_m)
    columns, rows = maps.columns * SIDE, maps.visit_tiles.shape[1] // maps.columns * SIDE
    from_x, from_y = pose[0] * per_m - maps.left * SIDE, pose[1] * per_m - maps.low * SIDE
    for k in range(count):
        ax, ay = c * points[k, X] - s * points[k, Y], s * points[k, X] + c * points[k, Y]
        nx, ny = c * points[k, NX] - s * points[k, NY], s * points[k, NX] + c * points[k, NY]
        near[k, 0], near[k, 1], near[k, 6] = ax, ay, -1.0
        at_x, at_y = from_x + ax * per_m, from_y + ay * per_m
        column, row = int(np.floor(at_x)), int(np.floor(at_y))
        if column < 1 or row < 1 or column + 1 >= columns or row + 1 >= rows:
            continue
        directed = nx != 0.0 or ny != 0.0
        weight, px, py, qx, qy = 0.0, 0.0, 0.0, 0.0, 0.0
        last, hit_tile, visit_tile = -1, np.int32(0), np.int32(0)
        for r in range(row - 1, row + 2):
            for q in range(column - 1, column + 2):
                tile = (r >> 3) * maps.columns + (q >> 3)
                if tile != last:
                    last, hit_tile = tile, maps.hit_tiles[particle, tile]
                    visit_tile = maps.visit_tiles[particle, tile]
                if hit_tile == 0:
                    continue
                cell = ((r & 7) << 3) | (q & 7)
                hits = maps.hits[hit_tile, cell]
                if hits == 0 or hits < OCCUPIED * maps.visits[visit_tile, cell]:
                    continue
                dx = (q + 0.5 - at_x) * cell_m + maps.means[hit_tile, cell, 0]
                dy = (r + 0.5 - at_y) * cell_m + maps.means[hit_tile, cell, 1]
                close = 1.0 - (dx * dx + dy * dy) * far
                if close <= 0.0:
                    continue
                mx, my = maps.means[hit_tile, cell, 2], maps.means[hit_tile, cell, 3]
                if directed:
                    same, size = nx * mx + ny * my, mx * mx + my * my
                    if size > 0.0 and (same < 0.0 or same * same < SAME_SIDE * SAME_SIDE * size):
                        continue
                w = close * close * min(hits, MOST_HITS)
                weight += w
                px += w * dx
                py += w * dy
                qx += w * mx
                qy += w * my
        if weight == 0.0:
            visit_tile = maps.visit_tiles[particle, (row >> 3) * maps.columns + (column >> 3)]
            if visit_tile != 0 and maps.visits[visit_tile, ((row & 7) << 3) | (column & 7)] > 0:
                near[k, 6] = 0.0
            continue
        part = 1.0 / weight
        size = np.sqrt(qx * qx + qy * qy)
        if size * part > KNOWN_NORMAL:
            nx, ny = qx / size, qy / size
        near[k, 2], near[k, 3], near[k, 4], near[k, 5] = px * part, py * part, nx, ny
        near[k, 6] = 1.0


@inner(_f8(_f8x2, _i8, FIT, _f8x1))
def compare(near, count, fit, system):
    """The log-likelihood of a scan and its ``surfaces``, and the normal equations [9] of a
    Gauss-Newton step: xx, xy, xt, yy, yt, tt of J^T W J, then x, y, t of -J^T W r."""
    system[:] = 0.0
    total, spread = 0.0, -0.5 / (fit.sigma_m * fit.sigma_m)
    outlier = 1.0 / (fit.scale_m * fit.scale_m)
    for k in range(count):
        if near[k, 6] <= 0.0:
            total += UNKNOWN if near[k, 6] < 0.0 else MISSED
            continue
        ax, ay, dx, dy, nx, ny = near[k, 0], near[k, 1], near[k, 2], near[k, 3], near[k, 4], near[
            k, 5]
        if nx == 0.0 and ny == 0.0:
            squared = dx * dx + dy * dy
            w = 1.0 + squared * outlier
            w = LOOSE / (w * w)
            system[0] += w
            system[2] -= w * ay
            system[3] += w
            system[4] += w * ax
            system[5] += w * (ax * ax + ay * ay)
            system[6] += w * dx
            system[7] += w * dy
            system[8] += w * (ax * dy - ay * dx)
        else:
            away = nx * dx + ny * dy
            squared = away * away
            w = 1.0 + squared * outlier
            w = 1.0 / (w * w)
            t = ax * ny - ay * nx
            system[0] += w * nx * nx
            system[1] += w * nx * ny
            system[2] += w * nx * t
            system[3] += w * ny * ny
            system[4] += w * ny * t
            system[5] += w * t * t
            system[6] += w * nx * away
            system[7] += w * ny * away
            system[8] += w * t * away
        total += max(spread * squared, MISSED)
    return total * fit.effective / max(count, 1)


@inner(_f8(_f8x1, _f8x1, _f8x1, _f8x1))
def add_odometry(pose, expected, sigmas, system):
    """Add the odometry to the normal equations; returns its log-likelihood at the pose.

    ``expected``: the pose by odometry | ``sigmas`` [3]: its standard deviations along the robot,
    across it (m) and of its heading (rad).
    """
    c, s = cos(expected[2]), sin(expected[2])
    dx, dy, dt = pose[0] - expected[0], pose[1] - expected[1], pose[2] - expected[2]
    along, across = c * dx + s * dy, c * dy - s * dx
    a, b, t = 1.0 / sigmas[0] ** 2, 1.0 / sigmas[1] ** 2, 1.0 / sigmas[2] ** 2
    system[0] += a * c * c + b * s * s
    system[1] += (a - b) * c * s
    system[3] += a * s * s + b * c * c
    system[5] += t
    system[6] -= a * along * c - b * across * s
    system[7] -= a * along * s + b * across * c
    system[8] -= t * dt
    return -0.5 * (a * along * along + b * across * across + t * dt * dt)


@inner(types.boolean(_f8x1, _f8x1))
def factorize(system, root):
    """Write Cholesky's factor [6] (rows of the lower triangle) of the matrix in normal equations.
    Returns whether it has one."""
    root[0] = np.sqrt(system[0])
    root[1] = system[1] / root[0]
    root[2] = np.sqrt(system[3] - root[1] * root[1])
    root[3] = system[2] / root[0]
    root[4] = (system[4] - root[1] * root[3]) / root[2]
    root[5] = np.sqrt(system[5] - root[3] * root[3] - root[4] * root[4])
    return root[0] > 0.0 and root[2] > 0.0 and root[5] > 0.0


@inner(types.UniTuple(_f8, 3)(_f8x1, _f8, _f8, _f8))
def solve_transposed(root, x, y, t):
    """v with L^T v = (x, y, t). Standard normal numbers become a draw of covariance (L L^T)^-1."""
    vt = t / root[5]
    vy = (y - root[4] * vt) / root[2]
    vx = (x - root[1] * vy - root[3] * vt) / root[0]
    return vx, vy, vt


@inner(types.UniTuple(_f8, 3)(_f8x1, _f8, _f8, _f8))
def solve(root, x, y, t):
    """v with L L^T v = (x, y, t)."""
    ux = x / root[0]
    uy = (y - root[1] * ux) / root[2]
    ut = (t - root[3] * ux - root[4] * uy) / root[5]
    return solve_transposed(root, ux, uy, ut)


@kernel(types.UniTuple(_f8, 2)(_i8, _f8x1, _f8x1, _f8x1, _f8x2, _i8, MAPS, FIT, _f8x1))
def align(particle, pose, expected, sigmas, points, count, maps, fit, root):
    """Move ``pose`` [3] to the most likely one nearby. Returns the log-likelihoods of the scan and
    of the odometry there; ``root`` [6], out: Cholesky's factor of the information.

    A step that makes the whole less likely is halved twice, then taken back.
    """
    system, best, near = np.empty(9), np.empty(3), np.empty((count, 7))
    scale = fit.effective / (max(count, 1) * fit.sigma_m * fit.sigma_m)
    scan, odometry = -np.inf, -np.inf
    sx, sy, st, halvings = 0.0, 0.0, 0.0, 0
    for step in range(fit.steps + 1):
        surfaces(particle, pose, points, count, fit.reach_m, maps, near)
        likelihood = compare(near, count, fit, system)
        for k in range(9):
            system[k] *= scale
        prior = add_odometry(pose, expected, sigmas, system)
        if step > 0 and likelihood + prior < scan + odometry:
            sx, sy, st, halvings = 0.5 * sx, 0.5 * sy, 0.5 * st, halvings + 1
            if halvings > 2:
                break
        else:
            scan, odometry = likelihood, prior
            best[0], best[1], best[2] = pose[0], pose[1], pose[2]
            if not factorize(system, root):
                break
            sx, sy, st = solve(root, system[6], system[7], system[8])
            if sx * system[6] + sy * system[7] + st * system[8] < 2.0 * GAIN:
                best[0], best[1], best[2] = best[0] + sx, best[1] + sy, best[2] + st
                break
        pose[0], pose[1], pose[2] = best[0] + sx, best[1] + sy, best[2] + st
    pose[0], pose[1], pose[2] = best[0], best[1], best[2]
    return scan, odometry


@inner(types.float64(_f8x1))
def log_determinant(root):
    """Logarithm of the determinant of L, from Cholesky's factor [6]."""
    return log(root[0]) + log(root[2]) + log(root[5])
