"""Fading as a function of a counter: who was asked before does not matter."""

from __future__ import annotations

import math

import numpy as np
from numba import float64, int64, uint64, void

from netmodels.kernels import cos, lean, log, uniform

_TWO_PI = 2 * math.pi
_ONE, _TWO = np.uint64(1), np.uint64(2)


@lean(void(uint64[::1], int64[::1], int64[::1], uint64, float64, float64[::1]))
def gains(keys, one, other, block, steady, out):
    """[k] power gains in ``block`` between hosts ``one`` and ``other`` [k], of mean 1: what comes
    straight has ``steady`` times the power of what is scattered (0: nothing does).

    |sqrt(K) + z|^2 / (K + 1), z complex normal, whose power is exponential and whose angle is
    uniform (Box and Muller 1958). The key of a pair is the sum of its hosts', in either order.
    """
    for k in range(out.size):
        key = keys[one[k]] + keys[other[k]]
        scattered = -log(1.0 - uniform(key, _TWO * block))
        gain = scattered + steady
        if steady > 0.0:
            angle = _TWO_PI * uniform(key, _TWO * block + _ONE)
            gain += 2.0 * math.sqrt(steady * scattered) * cos(angle)
        out[k] = gain / (steady + 1.0)
