"""The former place of the model ``radio``, for installations that are older than ``radio.py``."""

from netmodels.radio.radio import Radio as Ladder

__all__ = ["Ladder"]
