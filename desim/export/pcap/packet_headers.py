"""The headers of simulated packets, as bytes that packet analysers read.

Of a packet only sizes, times and hosts are simulated. Addresses are made of the hosts' indices, and
its content is left out: a capture cuts packets behind their headers (``SNAP_BYTES``).
"""

from __future__ import annotations

import struct
from functools import lru_cache
from typing import NamedTuple

SNAP_BYTES = 128  # of a packet are kept: all of its headers
ETHERNET_BYTES, CHECK_BYTES = 14, 4
_BROADCAST = b"\xff" * 6
_BSSID = b"\x02\xde\x51\x00\x00\x00"  # a locally administered address, as an IBSS has
_IPV4, _ARP = 0x0800, 0x0806
_PROTOCOL = {"tcp": 6, "udp": 17}
_IP_BYTES, _UDP_BYTES = 20, 8
# Largest segment 1460 B, selective acknowledgements, a window scaled by 2^7, and a filler.
_SYN_OPTIONS = bytes([2, 4, 1460 >> 8, 1460 & 0xFF, 4, 2, 3, 3, 7, 1])
_FILLER = b"\x01\x01"
_TCP_HEAD, _STAMPS = struct.Struct(">HHIIBBHHH").pack, struct.Struct(">BBII").pack
_REMEMBERED = 1 << 16  # headers and addresses
_WHOLE = 1 << 32  # sequence numbers and TCP's clock
SYN, ACK, RST, FIN, PUSH = 0x02, 0x10, 0x04, 0x01, 0x08


class Segment(NamedTuple):
    """The numbers of a TCP segment: its first byte, what it acknowledges, and its flags."""

    seq: int
    ack: int
    flags: int


class CapturedPacket(NamedTuple):
    """A packet with Ethernet's headers and check sequence in its ``size_bytes``. ``receiver`` is
    the first one of a broadcast. ``ports`` are those of the source and of the destination."""

    time_ns: int
    source: int
    receiver: int
    broadcast: bool
    size_bytes: int
    protocol: str
    ports: tuple[int, int]
    segment: Segment
    number: int  # of the packets of its source


@lru_cache(_REMEMBERED)
def hardware_address(host: int) -> bytes:
    """The locally administered MAC address of host ``host``: 02:00:00:00:00:01 of the first."""
    return struct.pack(">HI", 0x0200, host + 1)


@lru_cache(_REMEMBERED)
def internet_address(host: int) -> bytes:
    """The IPv4 address of host ``host``: 10.0.0.1 of the first."""
    return struct.pack(">I", 0x0A000000 + host + 1)


def network_packet(packet: CapturedPacket) -> tuple[int, bytes]:
    """Its Ethernet type, and the beginning of what Ethernet carries."""
    if packet.protocol == "arp":
        return _ARP, struct.pack(
            ">HHBBH6s4s6s4s", 1, _IPV4, 6, 4, 1 if packet.broadcast else 2,
            hardware_address(packet.source), internet_address(packet.source),
            b"\0" * 6 if packet.broadcast else hardware_address(packet.receiver),
            internet_address(packet.receiver))
    body = _tcp(packet) if packet.protocol == "tcp" else _udp(packet)
    size_bytes = max(packet.size_bytes - ETHERNET_BYTES - CHECK_BYTES, _IP_BYTES + len(body))
    return _IPV4, _ip(packet.source, -1 if packet.broadcast else packet.receiver, size_bytes,
                      packet.protocol) + body


@lru_cache(_REMEMBERED)
def _ip(source: int, receiver: int, size_bytes: int, protocol: str) -> bytes:
    """The header of a packet that may not be fragmented and so needs no number (RFC 6864);
    ``receiver`` -1: all."""
    address = b"\xff" * 4 if receiver < 0 else internet_address(receiver)
    head = struct.pack(">BBHHHBBH4s4s", 0x45, 0, size_bytes & 0xFFFF, 0, 0x4000, 64,
                       _PROTOCOL[protocol], 0, internet_address(source), address)
    return head[:10] + struct.pack(">H", _checksum(head)) + head[12:]


def _checksum(data: bytes) -> int:
    """The internet checksum (RFC 1071) of an even number of bytes."""
    total = sum(struct.unpack(f">{len(data) // 2}H", data))
    while total >> 16:
        total = (total & 0xFFFF) + (total >> 16)
    return ~total & 0xFFFF


def _udp(packet: CapturedPacket) -> bytes:
    size_bytes = max(packet.size_bytes - ETHERNET_BYTES - CHECK_BYTES - _IP_BYTES, _UDP_BYTES)
    return struct.pack(">HHHH", *packet.ports, size_bytes & 0xFFFF, 0)


def _tcp(packet: CapturedPacket) -> bytes:
    seq, ack, flags = packet.segment
    source, to = packet.ports
    options = _SYN_OPTIONS if flags & SYN else _FILLER
    return _TCP_HEAD(source, to, seq % _WHOLE, ack % _WHOLE, (30 + len(options)) // 4 << 4, flags,
                     0xFFFF, 0, 0) \
        + options + _STAMPS(8, 10, packet.time_ns // 1_000_000 % _WHOLE, 0)


def _destination(packet: CapturedPacket) -> bytes:
    return _BROADCAST if packet.broadcast else hardware_address(packet.receiver)


def ethernet(packet: CapturedPacket) -> tuple[bytes, int]:
    """The beginning of its Ethernet frame, and the length of the whole frame."""
    kind, body = network_packet(packet)
    head = _destination(packet) + hardware_address(packet.source) + struct.pack(">H", kind)
    return _cut(head + body, packet.size_bytes, CHECK_BYTES)


class Radiotap(NamedTuple):
    """A radio as a capture describes it: the channel's frequency, radiotap's word for its kind, and
    the rates of unicast and broadcast frames in bit/s (None: they change)."""

    mhz: int
    kind: int
    rate_bps: int | None
    broadcast_rate_bps: int | None

    def frame(self, packet: CapturedPacket) -> tuple[bytes, int]:
        """The beginning of its 802.11 data frame behind a radiotap header, and the length of both.

        A frame between stations without an access point: 24 B of header, 8 B of LLC and SNAP and
        4 B of check sequence in place of Ethernet's 18 B.
        """
        rate_bps = self.broadcast_rate_bps if packet.broadcast else self.rate_bps
        tap = self._head(packet.time_ns // 1000, rate_bps)
        kind, body = network_packet(packet)
        head = struct.pack("<HH", 0x0008, 0) + _destination(packet) \
            + hardware_address(packet.source) + _BSSID \
            + struct.pack("<H", packet.number % 4096 << 4) \
            + b"\xaa\xaa\x03\0\0\0" + struct.pack(">H", kind)
        data, size_bytes = _cut(head + body, packet.size_bytes - ETHERNET_BYTES + len(head),
                                CHECK_BYTES)
        return tap + data, len(tap) + size_bytes

    def _head(self, time_us: int, rate_bps: int | None) -> bytes:
        """TSFT, flags (a check sequence at the end), the rate if it is known, and the channel
        (www.radiotap.org)."""
        known = rate_bps is not None and rate_bps % 500_000 == 0 and rate_bps < 256 * 500_000
        rate = bytes([rate_bps // 500_000]) if known and rate_bps is not None else b"\0"
        present = 1 << 0 | 1 << 1 | known << 2 | 1 << 3
        fields = struct.pack("<QB", time_us, 0x10) + rate + struct.pack("<HH", self.mhz, self.kind)
        return struct.pack("<BBHI", 0, 0, 8 + len(fields), present) + fields


def _cut(data: bytes, size_bytes: int, check_bytes: int) -> tuple[bytes, int]:
    """The beginning of a frame, and its whole length. Its padding is left out, and the check
    sequence, which would be wrong."""
    return data[:max(0, min(len(data), size_bytes - check_bytes))], size_bytes
