"""Sizes of packets: headers, and the most that fits."""

from __future__ import annotations

from netmodels.ethernet import ETHERNET_BYTES
from netmodels.radio.standards import MOST_BYTES

UDP_IP_BYTES = 8 + 20  # headers (RFC 768, RFC 791)
PPP_BYTES = 2  # header, as in ns-3's point-to-point links

# Payload in one packet of 802.11, and of UDP in that; 65535 B of IP, without the headers.
MOST_80211_BYTES = MOST_BYTES - ETHERNET_BYTES
MOST_RADIO_BYTES = MOST_80211_BYTES - UDP_IP_BYTES
MOST_UDP_BYTES = 65_535 - UDP_IP_BYTES
