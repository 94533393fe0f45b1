"""Files of packets with times in nanoseconds, for Wireshark and tshark (pcap, magic 0xa1b23c4d)."""

from __future__ import annotations

import struct
from typing import BinaryIO

from desim.export.pcap.packet_headers import (
    CHECK_BYTES,
    SNAP_BYTES,
    CapturedPacket,
    Radiotap,
    ethernet,
)
from desim.units import NS_PER_S

_MAGIC_NS = 0xA1B23C4D
# Link types with the length of the check sequence, which is in packets' lengths: bit 26, and
# two-byte words from bit 28 (draft-ietf-opsawg-pcap).
_ETHERNET = 1 | 1 << 26 | CHECK_BYTES // 2 << 28
_RADIOTAP = 127


class PcapWriter:
    """Writes packets into ``file`` in the order in which they come. ``radio`` None: Ethernet."""

    def __init__(self, file: BinaryIO, radio: Radiotap | None = None) -> None:
        self._file = file
        self._frame = ethernet if radio is None else radio.frame
        file.write(struct.pack("<IHHiIII", _MAGIC_NS, 2, 4, 0, 0, SNAP_BYTES,
                               _ETHERNET if radio is None else _RADIOTAP))

    def write(self, packet: CapturedPacket) -> None:
        data, size_bytes = self._frame(packet)
        seconds, rest_ns = divmod(packet.time_ns, NS_PER_S)
        kept = data[:SNAP_BYTES]
        self._file.write(struct.pack("<IIII", seconds, rest_ns, len(kept), size_bytes) + kept)
