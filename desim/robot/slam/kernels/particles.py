"""Loops over particles: the next pose and weight of each, and which of them survive resampling."""

from typing import NamedTuple

import numpy as np

from desim.ports.kernels import exp, inner, kernel, lean, normal, types, uniform
from desim.robot.slam.kernels.alignment import (
    FIT,
    add_odometry,
    align,
    log_determinant,
    solve_transposed,
)
from desim.robot.slam.kernels.tiles import MAPS

_f8, _i8, _f8x1, _f8x2 = types.float64, types.int64, types.float64[::1], types.float64[:, ::1]
_u8 = types.uint64


class MotionPrior(NamedTuple):
    """The odometry's uncertainty about the poses it expects: standard deviations ``sigmas`` [3]
    along the robot, across it (m) and of its heading (rad); the ``wide`` ones [3] with which scans
    are aligned; ``strayed``: the log-likelihood of the odometry counts as ``-strayed`` at least;
    and whether the best particle's pose is ``far`` from the expected one."""

    sigmas: np.ndarray
    wide: np.ndarray
    strayed: float
    far: bool


MOTION_PRIOR = types.NamedTuple([_f8x1, _f8x1, _f8, types.boolean], MotionPrior)


@inner(_f8(_f8x1, _f8x1, MOTION_PRIOR, _f8x1))
def by_odometry(pose, expected, odometry, system):
    """The log-likelihood of a pose by the odometry (``system`` [9]: to work in)."""
    return max(add_odometry(pose, expected, odometry.sigmas, system), -odometry.strayed)


@kernel(types.void(_f8x2, _f8x2, MOTION_PRIOR, _f8x2, _i8, MAPS, FIT, FIT, _f8, _i8, _u8, _u8,
                   _f8x1, _f8x2))
def propose(poses, expected, odometry, points, count, maps, fit, rough, spread, best, key, counter,
            weights, roots):
    """Move each particle to a draw from its improved proposal, and write its log-weight.

    ``poses`` [particles, 3]: where the alignment begins, out: the draws | ``expected`` [particles,
    3]: the poses by odometry | ``spread``: standard deviations are multiplied with it; 0 takes the
    most likely pose, as the particle ``best`` always does | ``key``, ``counter``: those of the
    first of 3 normal numbers for each particle | ``weights`` [particles], out: log-weights of this
    scan | ``roots`` [particles, 6], out: Cholesky factors of the information.

    The proposal is the normal distribution around the most likely pose of scan and odometry; its
    integral is the weight: p(z | x) p(x | u) sqrt(det(2 pi C)) (Grisetti, Stachniss and Burgard
    2007, equations 11 to 19, with Laplace's approximation instead of samples).

    ``poses`` begin where the best particle's correction puts each. If that is ``far``, as when a
    loop closes, a particle that closes the loop correctly by itself must not be moved: so each one
    takes the likelier of two ``rough`` alignments, from there and from its own odometry.
    """
    own, system = np.empty(3), np.empty(9)
    for k in range(len(poses)):
        if odometry.far:
            for c in range(3):
                own[c] = expected[k, c]
            there, _ = align(k, poses[k], expected[k], odometry.wide, points, count, maps, rough,
                             roots[k])
            here, _ = align(k, own, expected[k], odometry.wide, points, count, maps, rough,
                            roots[k])
            there += by_odometry(poses[k], expected[k], odometry, system)
            if here + by_odometry(own, expected[k], odometry, system) > there:
                for c in range(3):
                    poses[k, c] = own[c]
        scan, _ = align(k, poses[k], expected[k], odometry.wide, points, count, maps, fit, roots[k])
        weights[k] = (scan + by_odometry(poses[k], expected[k], odometry, system)
                      - log_determinant(roots[k]))
        if spread > 0.0 and k != best:
            first = counter + _u8_of(3 * k)
            x, y, t = solve_transposed(roots[k], normal(key, first), normal(key, first + _u8_of(1)),
                                       normal(key, first + _u8_of(2)))
            poses[k, 0] += spread * x
            poses[k, 1] += spread * y
            poses[k, 2] += spread * t


@inner("u8(i8)")
def _u8_of(number):
    return np.uint64(number)


@lean("f8(f8[::1], f8[::1])")
def normalize(weights, shares):
    """Write the normalized weights of log-weights as ``shares``. Returns the effective sample size,
    1 / sum of their squares (Liu 1996)."""
    top = weights[0]
    for k in range(len(weights)):
        top = max(top, weights[k])
    total = 0.0
    for k in range(len(weights)):
        shares[k] = exp(weights[k] - top)
        total += shares[k]
    squares = 0.0
    for k in range(len(weights)):
        shares[k] /= total
        squares += shares[k] * shares[k]
    return 1.0 / squares


@lean("i8(f8[:,::1], i8, f8, f8, f8[:,::1])")
def occupied_bins(poses, centre, bin_m, bin_rad, bins):
    """The number of different bins of poses [particles, 3] that particles are in. The pose of
    particle ``centre`` is in the middle of one. ``bins`` [particles, 3]: to work in."""
    count = 0
    for k in range(len(poses)):
        turn = poses[k, 2] - poses[centre, 2]
        turn -= 2.0 * np.pi * np.floor(turn / (2.0 * np.pi) + 0.5)
        bins[count, 0] = np.floor((poses[k, 0] - poses[centre, 0]) / bin_m + 0.5)
        bins[count, 1] = np.floor((poses[k, 1] - poses[centre, 1]) / bin_m + 0.5)
        bins[count, 2] = np.floor(turn / bin_rad + 0.5)
        other = 0
        while (bins[other, 0] != bins[count, 0] or bins[other, 1] != bins[count, 1]
               or bins[other, 2] != bins[count, 2]):
            other += 1
        if other == count:
            count += 1
    return count


@lean("void(f8[::1], u8, u8, i8[::1], i8[::1])")
def ancestors(shares, key, counter, copies, chosen):
    """Systematic resampling (Carpenter, Clifford and Fearnhead 1999) by one uniform number.

    ``shares``, ``copies`` [particles before]; ``copies``: to work in | ``chosen`` [particles
    after], out: the ancestor of each. A particle that survives keeps its index, if there is one
    still, so that its map stays where it is.
    """
    wanted = len(chosen)
    copies[:] = 0
    at, reached, made = uniform(key, counter), 0.0, 0
    for k in range(len(shares)):
        reached += shares[k] * wanted
        while at < reached:
            copies[k] += 1
            made += 1
            at += 1.0
    copies[0] += wanted - made  # rounding at the last border
    for k in range(wanted):
        chosen[k] = -1
        if k < len(shares) and copies[k] > 0:
            copies[k] -= 1
            chosen[k] = k
    spare = 0
    for k in range(wanted):
        if chosen[k] < 0:
            while copies[spare] == 0:
                spare += 1
            copies[spare] -= 1
            chosen[k] = spare
