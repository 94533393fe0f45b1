"""The former place of ``TwoPairs``, for installations that are older than ``two_senders.py``."""

from netmodels.cases.two_senders import TwoPairs

__all__ = ["TwoPairs"]
