"""Radios of IEEE 802.11a, b or g without an access point.

``radio.Radio`` is the model; ``dcf.radio.DcfRadio`` is the whole radio, its rung ``mac``.
"""
