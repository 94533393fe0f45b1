"""Packets of Ethernet (IEEE 802.3): what hosts send over any medium."""

from __future__ import annotations

from desim.ports import FULL_PACKET_BYTES as FULL_BYTES

__all__ = ["CHECK_BYTES", "ETHERNET_BYTES", "FULL_BYTES", "GAP_BYTES", "LEAST_BYTES",
           "PREAMBLE_BYTES", "padded"]

CHECK_BYTES = 4  # frame check sequence
ETHERNET_BYTES = 14 + CHECK_BYTES  # header and check sequence
LEAST_BYTES = 64  # minFrameSize: shorter packets are padded on a cable
PREAMBLE_BYTES = 8  # with start delimiter, before each packet
GAP_BYTES = 12  # of silence behind each packet


def padded(size_bytes: int) -> int:
    """The bytes of a packet on a cable, padding included."""
    return size_bytes if size_bytes > LEAST_BYTES else LEAST_BYTES
