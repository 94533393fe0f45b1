"""The distributed coordination function of 802.11: stations that share the air."""
