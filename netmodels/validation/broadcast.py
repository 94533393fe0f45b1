"""The former place of groups of ``stations.py``, for older installations."""

from netmodels.validation.stations import Heartbeats

__all__ = ["Heartbeats"]
