"""The compiled loop that enters messages that have arrived."""

from __future__ import annotations

import numpy as np

from desim.ports.kernels import from_dtype, inner, lean, types

# A message that was delivered: its number in the run, the trace id of its topic, the indices of the
# hosts that sent and received it, its bytes, the times (ns) of its birth, of its first and of its
# last frame and of its arrival, its number at its host, and its topic's place in the tallies.
DELIVERY = np.dtype([(name, "<i8") for name in (
    "number", "topic", "source", "receiver", "size_bytes", "born_ns", "first_ns", "last_ns",
    "arrived_ns", "seq", "place")])

_deliveries = types.Array(from_dtype(DELIVERY), 1, "C")
_i8x1, _i8x2 = types.int64[::1], types.int64[:, ::1]


@inner("i8(i8, i8[::1])")
def bin_of(latency_ns: int, edges_ns: np.ndarray) -> int:
    """The number of edges at or below a latency."""
    low, high = 0, len(edges_ns)
    while low < high:
        middle = (low + high) >> 1
        if edges_ns[middle] <= latency_ns:
            low = middle + 1
        else:
            high = middle
    return low


@lean(types.void(_deliveries, types.int64, types.uint64[::1], _i8x1, _i8x2, _i8x1, _i8x1, _i8x2,
                 types.uint64[:, ::1]))
def enter(delivered: np.ndarray, kind: int, hosts: np.ndarray, edges_ns: np.ndarray,
          last_ns: np.ndarray, counts: np.ndarray, sizes: np.ndarray, latencies: np.ndarray,
          rows: np.ndarray) -> None:
    """Enter ``delivered`` [n] in the tallies by topic (``counts``, ``sizes``, ``latencies``) and in
    the time of the last arrival by source and receiver, and write trace ``rows`` [n, 5] of this
    ``kind``. ``hosts``: trace ids by index."""
    for k in range(len(delivered)):
        one = delivered[k]
        latency_ns = one.arrived_ns - one.born_ns
        counts[one.place] += 1
        sizes[one.place] += one.size_bytes
        latencies[one.place, bin_of(latency_ns, edges_ns)] += 1
        if one.arrived_ns > last_ns[one.source, one.receiver]:
            last_ns[one.source, one.receiver] = one.arrived_ns
        rows[k, 0] = np.uint64(one.arrived_ns)
        rows[k, 1] = np.uint64(kind) | hosts[one.receiver] << np.uint64(32)
        rows[k, 2] = hosts[one.source]
        rows[k, 3] = np.uint64(one.seq)
        rows[k, 4] = np.uint64(latency_ns)
