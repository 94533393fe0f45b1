"""Walls and people between a sender and its receivers."""

from __future__ import annotations

import numpy as np

from desim import ports


def walls_between(obstacles: ports.Obstacles, from_m: np.ndarray, to_m: np.ndarray) -> np.ndarray:
    """[n] how many walls are on the straight lines between ``from_m`` [2] and ``to_m`` [n, 2] m;
    none if an end is unknown (NaN)."""
    placed = np.flatnonzero(~np.isnan(to_m - from_m).any(axis=1))
    counts = np.zeros(len(to_m), np.int64)
    if len(obstacles.segments) and len(placed):
        lines = np.hstack([np.broadcast_to(from_m, (len(placed), 2)), to_m[placed]])
        counts[placed] = np.bincount(obstacles.crossings(lines)[:, 0], minlength=len(placed))
    return counts


def unobstructed(obstacles: ports.Obstacles, from_m: np.ndarray, to_m: np.ndarray) -> np.ndarray:
    """[n] bool, whether there is neither a wall nor a person on the straight lines, near the
    ground, between ``from_m`` [2] and ``to_m`` [n, 2] m; true if an end is unknown (NaN)."""
    seen = walls_between(obstacles, from_m, to_m) == 0
    lines = np.hstack([np.broadcast_to(from_m, to_m.shape), to_m])
    return seen & (obstacles.people_on(lines, np.zeros((len(to_m), 2))) == 0)
