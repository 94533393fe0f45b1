"""Minstrel-HT, the rate control of Linux (net/mac80211/rc80211_minstrel_ht.c of Linux 6.1)."""
