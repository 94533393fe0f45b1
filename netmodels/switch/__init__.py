"""A store-and-forward Ethernet switch and the queues of its ports."""

from netmodels.switch.switch import Switch

__all__ = ["Switch"]
