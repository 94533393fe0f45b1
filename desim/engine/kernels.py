"""The compiled loops of the trace's digest: a hash table of sums, with linear probing.

``keys`` [size] and ``sums`` [size, 3] (rows, and the two halves of the sum of their hashes) are one
table; size is a power of two, and a place without rows is free.
"""

from __future__ import annotations

import numpy as np

from desim.ports.kernels import inner, lean, mix

# Where the two halves of a row's hash begin. Any two different numbers will do: these are the first
# digits of pi behind the point.
_FIRST = np.uint64(0x243F6A8885A308D3)
_SECOND = np.uint64(0x13198A2E03707344)


@inner("i8(u8[::1], u8[:, ::1], u8)")
def _place(keys, sums, key):
    """The place of a key, or the free one where it belongs."""
    mask = np.uint64(keys.size - 1)
    at = mix(_FIRST, key) & mask
    while sums[at, 0] and keys[at] != key:
        at = (at + np.uint64(1)) & mask
    return np.int64(at)


@lean("i8(u8[:, ::1], u8[::1], u8[:, ::1], i8)")
def add(rows: np.ndarray, keys: np.ndarray, sums: np.ndarray, free: int) -> int:
    """Add the hash of each of ``rows`` [n, 5] to the sums of its key, the second word. At most
    ``free`` new keys are taken in. Returns the number of rows that were added."""
    for i in range(rows.shape[0]):
        at = _place(keys, sums, rows[i, 1])
        if not sums[at, 0]:
            if free == 0:
                return i
            free -= 1
            keys[at] = rows[i, 1]
        first, second = _FIRST, _SECOND
        for word in range(5):
            first = mix(first, rows[i, word])
            second = mix(second, rows[i, word])
        sums[at, 0] += np.uint64(1)
        sums[at, 1] += first
        sums[at, 2] += second
    return rows.shape[0]


@lean("void(u8[::1], u8[:, ::1], u8[::1], u8[:, ::1])")
def copy(keys: np.ndarray, sums: np.ndarray, larger_keys: np.ndarray,
         larger_sums: np.ndarray) -> None:
    """Copy a table into a larger one."""
    for i in range(keys.size):
        if sums[i, 0]:
            at = _place(larger_keys, larger_sums, keys[i])
            larger_keys[at] = keys[i]
            for half in range(3):
                larger_sums[at, half] = sums[i, half]
