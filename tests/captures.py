"""Reading of pcap files, without the code that writes them."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import NamedTuple


class Record(NamedTuple):
    """A packet of a capture: its time, its whole length, and the bytes that are kept of it."""

    time_ns: int
    length: int
    data: bytes


def records(path: Path) -> tuple[int, list[Record]]:
    """The link type of a capture with times in nanoseconds, and its packets."""
    data = path.read_bytes()
    magic, major, minor, _, _, snap, link = struct.unpack_from("<IHHiIII", data)
    assert (magic, major, minor, snap) == (0xA1B23C4D, 2, 4, 128)
    at, found = 24, []
    while at < len(data):
        s, ns, kept, length = struct.unpack_from("<IIII", data, at)
        found.append(Record(s * 10**9 + ns, length, data[at + 16:at + 16 + kept]))
        assert kept <= min(snap, length) and len(found[-1].data) == kept
        at += 16 + kept
    return link, found
