"""Captures of a medium for Wireshark and tshark."""
