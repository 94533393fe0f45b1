"""The former place of groups of ``rules.py``, for older installations."""

from netmodels.validation.rules import Bursts, Delays, FlappingAvailability

__all__ = ["Bursts", "Delays", "FlappingAvailability"]
