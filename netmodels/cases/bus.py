"""The former place of ``SharedBus``, for installations that are older than ``load.py``."""

from netmodels.cases.load import SharedBus

__all__ = ["SharedBus"]
