"""The former place of rules, for older installations."""

from netmodels.rules.timing import Duplication

__all__ = ["Duplication"]
