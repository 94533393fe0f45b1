"""What the cases have in common: sizes of packets, names of hosts, spans of time."""

from __future__ import annotations

from desim.ports.cases import Arrivals, Flow

UDP_IP_BYTES = 8 + 20  # headers (RFC 768, RFC 791)
ETHERNET_BYTES = 14 + 4  # header and check sequence
PPP_BYTES = 2  # header, as in ns-3's point-to-point links

# Payload of UDP in one packet: 2304 B of 802.11 (8 B are LLC), 65535 B of IP, without the headers.
MOST_RADIO_BYTES = 2304 - 8 - UDP_IP_BYTES
MOST_UDP_BYTES = 65_535 - UDP_IP_BYTES

_SETTLING = 2000  # frames until a queue that can carry its load is as full as it usually is


def numbered(name: str, count: int) -> tuple[str, ...]:
    """``sender_1``, ``sender_2``, ..."""
    return tuple(f"{name}_{number}" for number in range(1, count + 1))


def settling_frames(load: float, room: int) -> int:
    """How many frames can be sent until queues with ``room`` for so many are in a steady state:
    under overload, until they are full (and half as long again)."""
    return _SETTLING + (round(1.5 * room / (load - 1)) if load > 1 else 0)


def every(payload_bytes: int, rate_bps: float) -> int:
    """ns between packets that make ``rate_bps`` of payload."""
    return round(payload_bytes * 8e9 / rate_bps)


def flows(sources: tuple[str, ...], receiver: str, size_bytes: int, payload_bytes: int,
          arrivals: Arrivals, every_ns: int) -> list[Flow]:
    """From each to one."""
    return [Flow(source, (receiver,), size_bytes, payload_bytes, arrivals, every_ns)
            for source in sources]
