"""The former place of rules, for older installations."""

from netmodels.rules.timing import Latency

__all__ = ["Latency"]
