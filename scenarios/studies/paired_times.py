"""Exploration times of two settings, compared seed by seed: for the tables of studies."""

from __future__ import annotations

import numpy as np

from desim.statistics.comparisons import paired


def time_s(run) -> float:
    """The exploration time; the run's length where the terrain was not explored."""
    reached = run["exploration_time_s"]
    return run["simulated_s"] if reached is None else reached


def times_of(runs) -> dict[int, float]:
    """The exploration time by seed."""
    return {run["seed"]: time_s(run) for run in runs}


def share(own, reference) -> str:
    """The geometric mean of the times of equal keys (seeds), divided, with its 95 % interval."""
    keys = [key for key in own if key in reference]
    if len(keys) < 2:
        return ""
    difference = paired(*(np.log([times[key] for key in keys]) for times in (own, reference))
                        ).difference
    low, mean, high = np.exp([difference.low, difference.mean, difference.high])
    return f"{mean:.2f} ({low:.2f} to {high:.2f})"
