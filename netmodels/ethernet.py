"""Packets of Ethernet (IEEE 802.3): what hosts send over any medium."""

from __future__ import annotations

from functools import lru_cache

ETHERNET_BYTES = 14 + 4  # header and check sequence
FULL_BYTES = 1500 + ETHERNET_BYTES
LEAST_BYTES = 64  # minFrameSize: shorter packets are padded on a cable
GAP_BYTES = 8 + 12  # preamble with start delimiter, and the interframe gap


@lru_cache(maxsize=1 << 10)
def segment_sizes(size_bytes: int, segments: int) -> tuple[int, ...]:
    """The packets of a train: full ones and a rest where that fits, else as equal as can be."""
    rest = size_bytes - (segments - 1) * FULL_BYTES
    if 0 < rest <= FULL_BYTES:
        return (FULL_BYTES,) * (segments - 1) + (rest,)
    each, longer = divmod(size_bytes, segments)
    return (each + 1,) * longer + (each,) * (segments - longer)
