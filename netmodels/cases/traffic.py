"""The common parts of cases: packets and their sizes, and equal flows."""

from __future__ import annotations

from desim.ports.cases import Arrivals, Flow
from netmodels.ethernet import ETHERNET_BYTES
from netmodels.radio.standards import MOST_BYTES

UDP_IP_BYTES = 8 + 20  # headers (RFC 768, RFC 791)
PPP_BYTES = 2  # header, as in ns-3's point-to-point links

# Payload in one packet of 802.11, and of UDP in that; 65535 B of IP, without the headers.
MOST_80211_BYTES = MOST_BYTES - ETHERNET_BYTES
MOST_RADIO_BYTES = MOST_80211_BYTES - UDP_IP_BYTES
MOST_UDP_BYTES = 65_535 - UDP_IP_BYTES

# A path loss at which all stations hear each other equally well, with -50 dBm, wherever they are.
SAME_POWER = {"model": "fixed", "total": "66.0206 dB"}


def udp_bytes(payload_bytes: int) -> int:
    """The size of a packet of UDP with all headers, as a host counts it."""
    return payload_bytes + UDP_IP_BYTES + ETHERNET_BYTES


def numbered(name: str, count: int) -> tuple[str, ...]:
    """``sender_1``, ``sender_2``, ..."""
    return tuple(f"{name}_{number}" for number in range(1, count + 1))


def flows(sources: tuple[str, ...], receiver: str, size_bytes: int, payload_bytes: int,
          arrivals: Arrivals, every_ns: float = 0, backlog: int = 0) -> list[Flow]:
    """Equal flows, one from each of ``sources``."""
    return [Flow(source, (receiver,), size_bytes, payload_bytes, arrivals, round(every_ns), backlog)
            for source in sources]
