"""Comparisons with a relative tolerance."""

from __future__ import annotations

from desim.ports.cases import Check


def within(share: float, what: str, measured: float, published: float, unit: str = "") -> Check:
    """They may differ by a share of the published number."""
    return Check(what, measured, published, share * abs(published), unit)
