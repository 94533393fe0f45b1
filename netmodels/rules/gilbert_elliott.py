"""The former place of rules, for older installations."""

from netmodels.rules.loss import GilbertElliott

__all__ = ["GilbertElliott"]
