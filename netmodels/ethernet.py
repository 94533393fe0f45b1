"""Packets of Ethernet (IEEE 802.3): what hosts send over any medium."""

from __future__ import annotations

from desim.ports import FULL_PACKET_BYTES as FULL_BYTES
from desim.ports import packet_sizes as segment_sizes

__all__ = ["ETHERNET_BYTES", "FULL_BYTES", "GAP_BYTES", "LEAST_BYTES", "segment_sizes"]

ETHERNET_BYTES = 14 + 4  # header and check sequence
LEAST_BYTES = 64  # minFrameSize: shorter packets are padded on a cable
GAP_BYTES = 8 + 12  # preamble with start delimiter, and the interframe gap
