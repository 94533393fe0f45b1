"""The former place of rules, for older installations."""

from netmodels.rules.jamming import ResidualJamming
from netmodels.rules.loss import ResidualGilbertElliott, ResidualLoss

__all__ = ["ResidualGilbertElliott", "ResidualJamming", "ResidualLoss"]
