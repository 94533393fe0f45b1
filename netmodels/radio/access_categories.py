"""Access categories of 802.11 (EDCA): how urgent a packet is, and what that changes."""

from __future__ import annotations

from typing import Literal

from netmodels.radio.standards import Access, Standard

# Beacons have a queue of their own, and go as soon as the medium is idle for PIFS (ns-3,
# ApWifiMac's BeaconTxop; the beacon queues of Linux's ath9k, ath_beaconq_config). Their mark is
# behind those of packets.
BEACONS, BEACON_MARK = Access(1, 0, 0, 0, 4, "beacons"), 64

AccessCategory = Literal["background", "best_effort", "video", "voice"]

# By user priority (802.11-2016, table 10-1).
_OF_PRIORITY = (1, 0, 0, 1, 2, 2, 3, 3)


def categories(standard: Standard) -> tuple[Access, ...]:
    """The access to the medium by rank, of stations (Linux, ieee80211_set_wmm_default; 802.11-2012,
    table 8-105; ns-3, also of access points). Where 802.11b may be, TXOP limits are longer."""
    least, slow = standard.cw_min, standard.slow
    half, quarter = (least + 1) // 2 - 1, (least + 1) // 4 - 1
    return (Access(7, least, standard.cw_max, 0, 0, "background"),
            Access(3, least, standard.cw_max, 0, 1, "best_effort"),
            Access(2, half, least, 6_016_000 if slow else 3_008_000, 2, "video"),
            Access(2, quarter, half, 3_264_000 if slow else 1_504_000, 3, "voice"))


def of_hostapd(standard: Standard) -> tuple[Access, ...]:
    """The same of access points (tx_queue_data0 to 3 in hostapd_config_defaults of hostapd 2.10):
    best effort fails twice until its window is the largest, video and voice wait a slot less."""
    background, best_effort, video, voice = categories(standard)
    return (background, best_effort._replace(cw_max=4 * standard.cw_min + 3),
            video._replace(aifsn=1), voice._replace(aifsn=1))


def rank_of(dscp: int) -> int:
    """The rank of the category of packets with this mark: the three highest bits are the user
    priority (Linux, cfg80211_classify8021d)."""
    return _OF_PRIORITY[dscp >> 3]
