"""Sizes of packets, and names of hosts, in all cases."""

from __future__ import annotations

UDP_IP_BYTES = 8 + 20  # headers (RFC 768, RFC 791)
ETHERNET_BYTES = 14 + 4  # header and check sequence
PPP_BYTES = 2  # header, as in ns-3's point-to-point links


def numbered(name: str, count: int) -> tuple[str, ...]:
    """``sender_1``, ``sender_2``, ..."""
    return tuple(f"{name}_{number}" for number in range(1, count + 1))
