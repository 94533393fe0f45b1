"""Sizes of packets: headers, and the most that fits."""

from __future__ import annotations

UDP_IP_BYTES = 8 + 20  # headers (RFC 768, RFC 791)
ETHERNET_BYTES = 14 + 4  # header and check sequence
PPP_BYTES = 2  # header, as in ns-3's point-to-point links

# Payload of UDP in one packet: 2304 B of 802.11 (8 B are LLC), 65535 B of IP, without the headers.
MOST_RADIO_BYTES = 2304 - 8 - UDP_IP_BYTES
MOST_UDP_BYTES = 65_535 - UDP_IP_BYTES
