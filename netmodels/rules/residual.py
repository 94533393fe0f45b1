"""Losses behind the MAC: what is left over of them when a radio has repeated what it could."""

from __future__ import annotations

from netmodels.rules.gilbert_elliott import GilbertElliott
from netmodels.rules.jamming import Jamming
from netmodels.rules.loss import Loss


class ResidualLoss(Loss):
    """``loss`` that a radio does not repeat: each packet is lost with ``probability``, however
    often it was transmitted."""

    per_transmission = False


class ResidualGilbertElliott(GilbertElliott):
    """``gilbert_elliott`` that a radio does not repeat: the states change with packets, however
    often they were transmitted."""

    per_transmission = False


class ResidualJamming(Jamming):
    """``jamming`` that a radio does not repeat: each packet is lost with ``probability``, however
    often it was transmitted."""

    per_transmission = False
