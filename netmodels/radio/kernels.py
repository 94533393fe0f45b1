"""Loops over links: fading as a function of a counter, and people between antennas."""

from __future__ import annotations

import math

import numpy as np

from desim.ports.kernels import atan2, cos, lean, log, types, uniform_half_open

float64, int64, uint64, void = types.float64, types.int64, types.uint64, types.void

_TWO_PI = 2 * math.pi
_NEPER_DB = 8.685889638065037  # 20 / ln 10
_ONE, _TWO = np.uint64(1), np.uint64(2)
_LOW, _TOP = np.uint64(11), np.uint64(52)
_QUARTER, _TURN = np.uint64(1024), np.uint64(4095)


@lean(void(uint64[::1], int64[::1], int64[::1], uint64, float64, float64[::1]))
def gains(keys, one, other, block, steady, out):
    """[k] power gains in ``block`` between hosts ``one`` and ``other`` [k], of mean 1: what comes
    straight has ``steady`` times the power of what is scattered (0: nothing does).

    |sqrt(K) + z|^2 / (K + 1), z complex normal, whose power is exponential and whose angle is
    uniform (Box and Muller 1958). The key of a pair is the sum of its hosts', in either order.
    """
    for k in range(out.size):
        key = keys[one[k]] + keys[other[k]]
        scattered = -log(1.0 - uniform_half_open(key, _TWO * block))
        gain = scattered + steady
        if steady > 0.0:
            angle = _TWO_PI * uniform_half_open(key, _TWO * block + _ONE)
            gain += 2.0 * math.sqrt(steady * scattered) * cos(angle)
        out[k] = gain / (steady + 1.0)


@lean(void(uint64[::1], int64[::1], int64[::1], float64, uint64[:, ::1], uint64[:, ::1]))
def waves(keys, one, other, turns, start, rate):
    """The scattered waves between hosts ``one`` and ``other`` [k]: their phases [k, waves] in turns
    of 2^64 at the beginning, and how far they turn in a step, in which a wave from straight ahead
    turns by ``turns``.

    Wave n comes from the n-th part of all directions, somewhere in it, with any phase (Zheng and
    Xiao 2003; Clarke 1968: echoes from everywhere).
    """
    count = start.shape[1]
    for k in range(one.size):
        key = keys[one[k]] + keys[other[k]]
        for n in range(count):
            angle = _TWO_PI * (n + uniform_half_open(key, _TWO * np.uint64(n))) / count
            bits = np.uint64(uniform_half_open(key, _TWO * np.uint64(n) + _ONE) * 2.0 ** 53)
            start[k, n] = bits << _LOW
            rate[k, n] = np.uint64(np.int64(turns * cos(angle) * 2.0 ** 64))


@lean(void(uint64[:, ::1], uint64[:, ::1], uint64, float64, float64[::1], float64[::1]))
def echoes(start, rate, step, steady, cosines, out):
    """[k] power gains at ``step``, of mean 1: |sqrt(K) + sum of the waves / sqrt(n)|^2 / (K + 1),
    with ``steady`` = K; ``cosines`` [2^12] of a turn."""
    count = start.shape[1]
    for k in range(out.size):
        real = imaginary = 0.0
        for n in range(count):
            at = (start[k, n] + step * rate[k, n]) >> _TOP
            real += cosines[at]
            imaginary += cosines[(at + _QUARTER) & _TURN]
        real = real / math.sqrt(count) + math.sqrt(steady)
        out[k] = (real * real + imaginary * imaginary / count) / (steady + 1.0)


@lean(void(float64[:, ::1], float64[:, ::1], float64[:, ::1], float64, float64[::1]))
def bodies(people, lines, heights, wave, out):
    """[k] dB that ``people`` [n, 4] x, y, radius, height take of waves ``wave`` long, all in m, on
    ``lines`` [k, 4] x1 y1 x2 y2 between ``heights`` [k, 2]. See ``body_loss.py``."""
    for k in range(out.size):
        x, y = lines[k, 0], lines[k, 1]
        along_x, along_y = lines[k, 2] - x, lines[k, 3] - y
        long = math.sqrt(along_x * along_x + along_y * along_y)
        out[k] = 0.0
        for n in range(people.shape[0] if long > 0.0 else 0):
            to_x, to_y = people[n, 0] - x, people[n, 1] - y
            before = (to_x * along_x + to_y * along_y) / long
            aside = (to_x * along_y - to_y * along_x) / long
            high = heights[k, 0] + before / long * (heights[k, 1] - heights[k, 0])
            if not (0.0 < before < long and abs(aside) < people[n, 2] and high < people[n, 3]):
                continue
            through = 1.0
            for edge in (people[n, 2] + aside, people[n, 2] - aside):
                detour = (math.sqrt(before * before + edge * edge)
                          + math.sqrt((long - before) ** 2 + edge * edge) - long)
                through -= atan2(0.5 * math.pi * math.sqrt(math.pi * detour / wave),
                                 1.0) / math.pi
            out[k] -= _NEPER_DB * log(through)
