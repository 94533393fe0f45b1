"""Radios of IEEE 802.11a, b, g, n, ac and ax without an access point.

``radio.Radio`` is the model; ``dcf.radio.DcfRadio`` is the whole radio, its rung ``mac``.
"""
