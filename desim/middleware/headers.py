"""The headers of packets, and the sizes of messages with them."""

from __future__ import annotations

from functools import lru_cache

MTU_BYTES = 1500  # of Ethernet
ETHERNET_BYTES = 14 + 4  # header and check sequence (IEEE 802.3)
LEAST_FRAME_BYTES = 64  # minFrameSize (IEEE 802.3)
IP_BYTES = 20  # RFC 791, without options
UDP_HEADER_BYTES = ETHERNET_BYTES + IP_BYTES + 8  # all headers of a UDP datagram (RFC 768)
_TCP_BYTES = 20 + 12  # RFC 9293, with timestamps (RFC 7323)
SEGMENT_HEADER_BYTES = ETHERNET_BYTES + IP_BYTES + _TCP_BYTES  # all headers of a TCP segment
MSS_BYTES = MTU_BYTES - IP_BYTES - _TCP_BYTES
LENGTH_BYTES = 4  # roscpp: every serialized message is preceded by its length
UDPROS_PAYLOAD_BYTES = 1500 - 8  # roscpp transport_udp: datagrams of 1500 B with an 8 B header
DATAGRAM_HEADER_BYTES = UDP_HEADER_BYTES + 8  # and UDPROS


@lru_cache(maxsize=1 << 12)
def on_wire(payload_bytes: int) -> tuple[int, int]:
    """Bytes with all headers, and segments, of a TCP train of ``payload_bytes``."""
    segments = -(-payload_bytes // MSS_BYTES)
    return payload_bytes + segments * SEGMENT_HEADER_BYTES, segments


@lru_cache(maxsize=1 << 12)
def stream_frame(size_bytes: int) -> tuple[int, int]:
    """Bytes with all headers, and segments, of a message of ``size_bytes`` over TCP."""
    return on_wire(size_bytes + LENGTH_BYTES)


@lru_cache(maxsize=1 << 12)
def datagram_frame(size_bytes: int) -> tuple[int, int]:
    """Bytes with all headers, and datagrams, of a message of ``size_bytes`` over UDPROS. That IP
    would cut each full datagram (1528 B) once more is left out."""
    payload = size_bytes + LENGTH_BYTES
    segments = -(-payload // UDPROS_PAYLOAD_BYTES)
    return payload + segments * DATAGRAM_HEADER_BYTES, segments
