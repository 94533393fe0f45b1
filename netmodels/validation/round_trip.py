"""The former place of groups of ``rules.py``, for older installations."""

from netmodels.validation.rules import RoundTrip

__all__ = ["RoundTrip"]
