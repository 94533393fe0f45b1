"""Frames of IEEE 802.15.4 at 2.4 GHz: their airtimes, and packets of IP in them (6LoWPAN)."""

from __future__ import annotations

# IEEE 802.15.4-2015, O-QPSK PHY of 2450 MHz: 62.5 ksymbol/s, two symbols a byte.
BYTE_NS, UNIT_NS, CCA_NS, TURNAROUND_NS = 32_000, 320_000, 128_000, 192_000
_SHORT_SPACE_NS, _LONG_SPACE_NS = 192_000, 640_000  # SIFS, LIFS
ACK_WAIT_NS = 864_000  # macAckWaitDuration: 54 symbols
_PHY_BYTES, _ACK_BYTES, _SHORT_BYTES = 6, 5, 18  # the last: aMaxSIFSFrameSize
MOST_PSDU_BYTES = 127
MAC_BYTES = 9 + 2  # header with short addresses in one PAN, and check sequence
# 46 B of Ethernet, IP and UDP are 48 B of IPv6 and UDP here, and compressed 2 B (addresses elided)
# and 7 B (RFC 6282).
HEADERS_BYTES, _IPV6_BYTES, _IPHC_BYTES = 18 + 20 + 8, 40 + 8, 2 + 7
_FIRST_BYTES, _NEXT_BYTES = 4, 5  # headers of fragments (RFC 4944, 5.3)
MOST_BYTES = 2047 - _IPV6_BYTES + HEADERS_BYTES  # the field of a datagram's size has 11 bits


def frame_ns(psdu_bytes: int) -> int:
    """Airtime of a frame: 6 B of preamble, delimiter and length, and the PSDU."""
    return (_PHY_BYTES + psdu_bytes) * BYTE_NS


ACK_NS = frame_ns(_ACK_BYTES)


def space_ns(psdu_bytes: int) -> int:
    """The silence behind a frame, or its acknowledgement."""
    return _LONG_SPACE_NS if psdu_bytes > _SHORT_BYTES else _SHORT_SPACE_NS


def psdus(size_bytes: int) -> list[int]:
    """The bytes of the frames that carry a packet of ``size_bytes`` with Ethernet's headers: one,
    or fragments, of which all but the last carry a multiple of 8 B (RFC 4944, 5.3)."""
    left = max(size_bytes - HEADERS_BYTES, 0)
    whole = MAC_BYTES + _IPHC_BYTES + left
    if whole <= MOST_PSDU_BYTES:
        return [whole]
    sizes, headers = [], MAC_BYTES + _FIRST_BYTES + _IPHC_BYTES
    while left:
        carried = min(left, (MOST_PSDU_BYTES - headers) // 8 * 8)
        sizes.append(headers + carried)
        left, headers = left - carried, MAC_BYTES + _NEXT_BYTES
    return sizes
