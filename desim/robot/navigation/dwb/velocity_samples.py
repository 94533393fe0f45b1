"""Samples of velocities and of paths, as Nav2's DWB takes them."""

from __future__ import annotations

import numpy as np

_EPSILON = 1e-5  # one_d_velocity_iterator.hpp


def samples(now: float, low: float, high: float, reach: float, count: int) -> list[float]:
    """``count`` velocities in equal steps from the lowest to the highest that is within ``reach``
    of ``now``, and zero between two of unlike signs (OneDVelocityIterator)."""
    now = min(max(now, low), high)
    low, high = max(low, now - reach), min(high, now + reach)
    if high - low < _EPSILON:
        return [low]
    step = (high - low) / (max(count, 2) - 1)
    found = [low]
    while found[-1] + step <= high + _EPSILON:
        if found[-1] < 0.0 < found[-1] + step:
            found += [0.0, found[-1] + step]
        else:
            found.append(found[-1] + step)
    return found


def resampled(path: np.ndarray, cell_m: float) -> np.ndarray:
    """[k, 2] ``path`` with points between those that are more than two cells apart
    (adjustPlanResolution)."""
    parts = [path[:1]]
    for before, after in zip(path[:-1], path[1:], strict=True):
        length_m = float(np.hypot(*(after - before)))
        steps = int((length_m - 2.0 * cell_m) / cell_m) - 1
        if length_m > 2.0 * cell_m and steps > 1:
            share = np.arange(1, steps)[:, None] / steps
            parts.append(before + share * (after - before))
        parts.append(after[None])
    return np.concatenate(parts)
