"""The former place of groups of ``one_link.py``, for older installations."""

from netmodels.validation.one_link import SinglePair

__all__ = ["SinglePair"]
