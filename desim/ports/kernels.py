"""Functions that all compiled kernels share: transcendental ones, and noise by counter.

Kernels of desim and of plug-ins take sin, cos, exp, log and atan2 from here and nowhere else, so
that portable versions can replace the platform's libm in one place. A kernel's signature is one of
numba's, as are ``types``, ``from_dtype`` and ``carray`` (``desim.compiler.deferred``).

A kernel that is declared by ``kernel``, ``lean`` or ``inner`` is announced before it is compiled,
and kept. A plug-in may also import numba and compile by itself, which desim does not notice.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from desim.compiler.deferred import carray, from_dtype, intrinsic, types
from desim.compiler.kernel import compiled_function, kernel

__all__ = ["TWO_PI", "atan2", "carray", "compiled_function", "cos", "exp", "from_dtype", "inner",
           "intrinsic", "kernel", "lean", "log", "mix", "normal", "sin", "types", "uniform",
           "uniform_half_open"]

lean = partial(kernel, allocates=False)  # makes no arrays
inner = partial(lean, inner=True)  # and other kernels alone call it

TWO_PI = 2.0 * math.pi

# Constants of u8 arithmetic are np.uint64: numba turns uint64 with a plain int into float64.
_ONE = np.uint64(1)
_TWO = np.uint64(2)
_WEYL = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_S11, _S12, _S27, _S30, _S31 = (np.uint64(bits) for bits in (11, 12, 27, 30, 31))


@kernel("f8(f8)")
def sin(x):
    return math.sin(x)


@kernel("f8(f8)")
def cos(x):
    return math.cos(x)


@kernel("f8(f8)")
def exp(x):
    return math.exp(x)


@kernel("f8(f8)")
def log(x):
    return math.log(x)


@kernel("f8(f8, f8)")
def atan2(y, x):
    return math.atan2(y, x)


@kernel("u8(u8, u8)")
def mix(key, counter):
    """64 well-mixed bits of (key, counter): splitmix64's finalizer (Steele, Lea, Flood 2014) over
    a Weyl sequence that starts at the key."""
    z = key + (counter + _ONE) * _WEYL
    z = (z ^ (z >> _S30)) * _MIX_1
    z = (z ^ (z >> _S27)) * _MIX_2
    return z ^ (z >> _S31)


@lean("f8(u8, u8)")
def uniform(key, counter):
    """Uniform in (0, 1): number ``counter`` of the sequence ``key``, never 0 or 1.

    52 bits and a half: with one bit more, the half would round the largest up to 1.
    """
    return (np.float64(mix(key, counter) >> _S12) + 0.5) * (1.0 / 4503599627370496.0)


@lean("f8(u8, u8)")
def uniform_half_open(key, counter):
    """Uniform in [0, 1): number ``counter`` of the sequence ``key``, with 53 bits: a chance of 0
    never happens, and one of 1 always."""
    return np.float64(mix(key, counter) >> _S11) * (1.0 / 9007199254740992.0)


@lean("f8(u8, u8)")
def normal(key, counter):
    """Standard normal number ``counter`` of the sequence ``key`` (Box-Muller 1958, one of the pair:
    sqrt(-2 ln u1) cos(2 pi u2))."""
    u1 = uniform(key, _TWO * counter)
    u2 = uniform(key, _TWO * counter + _ONE)
    return math.sqrt(-2.0 * log(u1)) * cos(TWO_PI * u2)
