"""Samples: a row of the time series, or a part of a summary, with values by name."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

Sample = dict[str, Any]  # numbers and words; None: it is not known, or was not due


def mean(values: Sequence[float]) -> float | None:
    """The mean of ``values``, None without any."""
    return sum(values) / len(values) if values else None


def mean_over(samples: Iterable[Sample], name: str) -> float | None:
    """The mean of a quantity over the samples that have it; None where none has."""
    return mean([row[name] for row in samples if row[name] is not None])
