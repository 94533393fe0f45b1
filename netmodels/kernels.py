"""What the network models' kernels share: the transcendental functions, and random numbers as a
function of a counter.

The other ``kernels.py`` of this package take exp, log and cos from here and nowhere else, so that
portable versions can replace the platform's libm in one place. (``desim`` has a module like this
of its own: network models see nothing of it but its ports.)
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numba import njit

# For a kernel that makes no arrays, but only borrows those that it is given: nobody counts who
# holds them.
lean = partial(njit, cache=True, error_model="numpy", _nrt=False)

# Constants of u8 arithmetic are np.uint64: numba turns uint64 with a plain int into float64.
_ONE = np.uint64(1)
_WEYL = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_S11, _S27, _S30, _S31 = np.uint64(11), np.uint64(27), np.uint64(30), np.uint64(31)


@njit("f8(f8)", cache=True, inline="always")
def exp(x):
    return math.exp(x)


@njit("f8(f8)", cache=True, inline="always")
def log(x):
    return math.log(x)


@njit("f8(f8)", cache=True, inline="always")
def cos(x):
    return math.cos(x)


@lean("f8(u8, u8)")
def uniform(key, counter):
    """Uniform in [0, 1): number ``counter`` of the sequence ``key``; splitmix64 (Steele, Lea, Flood
    2014) over a Weyl sequence that starts at the key."""
    z = key + (counter + _ONE) * _WEYL
    z = (z ^ (z >> _S30)) * _MIX_1
    z = (z ^ (z >> _S27)) * _MIX_2
    return np.float64((z ^ (z >> _S31)) >> _S11) * (1.0 / 9007199254740992.0)
