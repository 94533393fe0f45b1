"""Routing over several hops: the model, its routing protocols and its hops."""

from netmodels.multihop.multihop import Multihop

__all__ = ["Multihop"]
