"""A path loss at which all stations hear each other equally well, wherever they are."""

SAME_POWER = {"model": "fixed", "total": "66.0206 dB"}  # everybody is heard with -50 dBm
