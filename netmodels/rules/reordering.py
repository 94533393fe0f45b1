"""The former place of rules, for older installations."""

from netmodels.rules.timing import Reordering

__all__ = ["Reordering"]
