"""Summaries of times in ns, in s."""

from __future__ import annotations

from collections.abc import Sequence

from desim.units import NS_PER_S, seconds


def mean_s(times_ns: Sequence[int]) -> float | None:
    """Their mean in s, None without any."""
    return sum(times_ns) / len(times_ns) / NS_PER_S if times_ns else None


def worst_s(times_ns: Sequence[int]) -> float | None:
    """The longest, in s."""
    return seconds(max(times_ns)) if times_ns else None
