"""Exploration times of two settings, compared seed by seed: for the tables of studies."""

from __future__ import annotations

import numpy as np

from desim.statistics.comparisons import paired


def times_of(runs) -> dict[int, float]:
    """The exploration time by seed; the run's length where the terrain was not explored."""
    return {run["seed"]: run["simulated_s"] if run["exploration_time_s"] is None
            else run["exploration_time_s"] for run in runs}


def share(own, reference) -> str:
    """The geometric mean of the times of equal seeds, divided, with its 95 % interval."""
    seeds = [seed for seed in own if seed in reference]
    if len(seeds) < 2:
        return ""
    difference = paired(*(np.log([times[seed] for seed in seeds]) for times in (own, reference))
                        ).difference
    low, mean, high = np.exp([difference.low, difference.mean, difference.high])
    return f"{mean:.2f} ({low:.2f} to {high:.2f})"
