"""Exploration times of two settings, compared run by run: for the tables of studies."""

from __future__ import annotations

import numpy as np

from desim.statistics.comparisons import Paired, holm, paired


def time_s(run) -> float:
    """The exploration time; the run's length where the terrain was not explored."""
    reached = run["exploration_time_s"]
    return run["simulated_s"] if reached is None else reached


def times_of(runs) -> dict[int, float]:
    """The exploration time by seed."""
    return {run["seed"]: time_s(run) for run in runs}


def share(own, reference) -> str:
    """The geometric mean of the times of equal seeds, divided, with its 95 % interval."""
    seeds = [seed for seed in own if seed in reference]
    return "" if len(seeds) < 2 else logarithms(own, reference, seeds).difference.quotient_text()


def print_shares(title: str, times: dict, reference: dict) -> None:
    """Print a row for each of ``times``, by setting and seed, against ``reference``: the share of
    time, geometric mean over pairs of one setting and seed with its 95 % interval; p of the paired
    t test by Holm; how many of the pairs are slower. Pairs of one seed may depend on each other, so
    that the last column has the interval over the means of seeds."""
    pairs, over_seeds = {}, {}
    for name, own in times.items():
        keys = [key for key in own if key in reference]
        if len(keys) > 1:
            pairs[name] = logarithms(own, reference, keys)
            over_seeds[name] = paired(*(_means_of_seeds(side, keys) for side in (own, reference)))
    adjusted = holm([1.0 if one.t_p is None else one.t_p for one in pairs.values()])
    print(f"\n| {title} | share of time | p (Holm) | slower | over seeds |")
    print("|---" * 5 + "|")
    for (name, one), p in zip(pairs.items(), adjusted, strict=True):
        seeds = over_seeds[name].difference
        between = "" if seeds.low is None else "{:.2f} to {:.2f}".format(
            *np.exp([seeds.low, seeds.high]))
        print(f"| {name} | {one.difference.quotient_text()} | {p:.2g} | "
              f"{one.above} of {one.difference.n} | {between} |")


def logarithms(own, reference, keys) -> Paired:
    """The logarithms of two settings' times, compared for equal ``keys``."""
    return paired(*(np.log([times[key] for key in keys]) for times in (own, reference)))


def _means_of_seeds(times, keys) -> list[float]:
    """The mean logarithm of the times of each seed; a key is a setting and a seed."""
    seeds = dict.fromkeys(seed for _, seed in keys)
    return [float(np.mean([np.log(times[key]) for key in keys if key[1] == seed]))
            for seed in seeds]
