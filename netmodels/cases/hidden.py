"""The former place of ``Hidden``, for installations that are older than ``two_senders.py``."""

from netmodels.cases.two_senders import Hidden

__all__ = ["Hidden"]
