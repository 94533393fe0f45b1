"""Real frames to test with, made field by field."""

from __future__ import annotations

import struct

from desim.loop.addresses import Address

ARP, IPV4 = 0x0806, 0x0800
EVERYBODY = b"\xff" * 6


def frame(payload: bytes = b"", *, to: bytes = EVERYBODY, source: int = 0, kind: int = IPV4,
          medium: int = 0) -> bytes:
    """An Ethernet frame of host number ``source``."""
    return to + Address(medium, source).mac + struct.pack(">H", kind) + payload


def ipv4(protocol: int, payload: bytes = b"", *, options: bytes = b"", fragment: int = 0,
         more: bool = False) -> bytes:
    """An IPv4 packet; ``fragment``: its offset in units of 8 bytes."""
    words = 5 + len(options) // 4
    return struct.pack(">BBHHHBBH8x", 0x40 | words, 0, 4 * words + len(payload), 0,
                       fragment | more << 13, 64, protocol, 0) + options + payload


def tcp(port: int, to_port: int, payload: bytes = b"", **options) -> bytes:
    """A TCP segment in its packet; ``options`` as those of ``ipv4``."""
    return ipv4(6, struct.pack(">HH16x", port, to_port) + payload, **options)


def udp(port: int, to_port: int, payload: bytes = b"", **options) -> bytes:
    """A UDP datagram, or a fragment of one, in its packet; ``options`` as those of ``ipv4``."""
    return ipv4(17, struct.pack(">HHHH", port, to_port, 8 + len(payload), 0) + payload, **options)
