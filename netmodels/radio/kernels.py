"""Fading as a function of a counter: it does not depend on earlier calls."""

from __future__ import annotations

import math

import numpy as np

from desim.ports.kernels import cos, lean, log, types, uniform_half_open

float64, int64, uint64, void = types.float64, types.int64, types.uint64, types.void

_TWO_PI = 2 * math.pi
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
