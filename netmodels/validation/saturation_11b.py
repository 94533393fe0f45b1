"""The former place of groups of ``stations.py``, for older installations."""

from netmodels.validation.stations import SaturationOf11b

__all__ = ["SaturationOf11b"]
