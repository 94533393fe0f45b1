"""Samples, which all functions here take: one finite number a run."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def sample(values: ArrayLike) -> np.ndarray:
    """``values`` as float64 [n]. Raises ``ValueError`` for another shape, NaN and inf: the caller
    leaves out, or censors, the runs without a value."""
    array = np.asarray(values, float)
    if array.ndim != 1:
        raise ValueError(f"one number a run is needed, got an array of shape {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError("a value is not finite")
    return array


def aligned(first: ArrayLike, second: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Two samples [n], value k of the one belonging to value k of the other. Raises
    ``ValueError`` if they are not equally long."""
    a, b = sample(first), sample(second)
    if len(a) != len(b):
        raise ValueError(f"{len(a)} values cannot be paired with {len(b)}")
    return a, b


def spread(values: np.ndarray, scale: float) -> float:
    """The standard deviation (n - 1) of two values or more; 0 where they differ by no more than
    the rounding of numbers as large as ``scale``."""
    return 0.0 if np.ptp(values) <= 1e-12 * scale else float(values.std(ddof=1))
