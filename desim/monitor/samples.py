"""Samples: a row of the time series, or a part of a summary, with values by name."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

Sample = dict[str, Any]  # numbers and words; None: it is not known, or was not due

# Of a rate or a load: one frame in a shorter time would make any rate. (Linux counts processors'
# time in ticks of 10 ms: USER_HZ is 100, proc(5).)
LEAST_WINDOW_NS = 10_000_000


def mean(values: Sequence[float]) -> float | None:
    """The mean of ``values``, None without any."""
    return sum(values) / len(values) if values else None


def mean_over(samples: Iterable[Sample], name: str) -> float | None:
    """The mean of a quantity over the samples that have it; None where none has."""
    return mean([row[name] for row in samples if row[name] is not None])
