"""The former place of groups of ``stations.py``, for older installations."""

from netmodels.validation.stations import SaturationOfOfdm

__all__ = ["SaturationOfOfdm"]
