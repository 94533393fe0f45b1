"""The frames of real programs on one medium, as they set out, in a file for Wireshark."""

from __future__ import annotations

import struct
from typing import BinaryIO

from desim.units import NS_PER_S

# The file's head: nanoseconds, version 2.4, frames of any size, Ethernet (pcap-savefile(5)).
_HEAD = struct.pack("<IHHiIII", 0xA1B23C4D, 2, 4, 0, 0, 65_535, 1)


class FrameCapture:
    """Writes frames into ``file``, as pcap."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        file.write(_HEAD)

    def add(self, now_ns: int, frame: bytes) -> None:
        """``frame`` sets out at ``now_ns``."""
        self._file.write(struct.pack("<IIII", *divmod(now_ns, NS_PER_S), len(frame), len(frame)))
        self._file.write(frame)
