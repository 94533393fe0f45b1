"""Where places do not matter."""

SAME_POWER = {"model": "fixed", "total": "66.0206 dB"}  # everybody is heard with -50 dBm
