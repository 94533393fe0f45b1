"""Access points: the stations that hang on them, and the wires between them."""

from netmodels.infrastructure.model import Infrastructure

__all__ = ["Infrastructure"]
