"""The former place of ``Bottleneck``, for installations that are older than ``load.py``."""

from netmodels.cases.load import Bottleneck

__all__ = ["Bottleneck"]
