"""Exploration times of the paper's campaigns, as cells of tables and compared seed by seed."""

from __future__ import annotations

from collections import Counter

import numpy as np

from desim.statistics.comparisons import Paired, holm, paired
from desim.statistics.intervals import t_interval


def time_s(run) -> float:
    """The exploration time, or the time limit."""
    reached = run["exploration_time_s"]
    return run["simulated_s"] if reached is None else reached


def levels(runs, name):
    """The levels of a parameter, in the campaign's order."""
    return list(dict.fromkeys(run[name] for run in runs))


def time_cell(runs) -> str:
    """Time, and how many were late, of runs of one vector."""
    late = sum(run["exploration_time_s"] is None for run in runs)
    return (t_interval([time_s(run) for run in runs]).text()
            + (f" ({late} of {len(runs)} late)" if late else "")) if runs else "–"


def cell(runs) -> str:
    """Time, way, and how many were late, of runs of one vector."""
    if not runs:
        return "–"
    late = sum(run["exploration_time_s"] is None for run in runs)
    return (f"{t_interval([time_s(run) for run in runs]).text()} ({way_km(runs)} km"
            + (f", {late} of {len(runs)} late)" if late else ")"))


def way_km(runs) -> str:
    """The mean way of all robots."""
    return "–" if not runs else f"{np.mean([run['exploration_cost_m'] for run in runs]) / 1000:.1f}"


def against(times: dict, others: dict) -> dict[str, tuple[str, str]]:
    """Each of ``times`` (by seed) that has one in ``others``, seed by seed: the share of time,
    geometric mean with its 95 % interval, and p of the paired t test by Holm."""
    return {name: (pair.difference.quotient_text(), f"{p:.2g}")
            for name, (pair, p) in compared(times, others).items()}


def compared(times: dict, others: dict) -> dict[str, tuple[Paired, float]]:
    """The logarithms of ``times`` compared with ``others`` of equal name and seed; p by Holm."""
    pairs = {}
    for name, other in others.items():
        seeds = [seed for seed in times[name] if seed in other]
        if len(seeds) > 1:
            pairs[name] = paired(np.log([times[name][seed] for seed in seeds]),
                                 np.log([other[seed] for seed in seeds]))
    adjusted = holm([1.0 if one.t_p is None else one.t_p for one in pairs.values()])
    return {name: (pairs[name], p) for name, p in zip(pairs, adjusted, strict=True)}


def compare(title: str, times: dict, others: dict, late: Counter, unit: str = "s") -> None:
    """Print a row for each of ``times`` (by seed) against that of ``others``, seed by seed: what
    ``against`` says, and the number of seeds that became faster."""
    pairs, shares = compared(times, others), against(times, others)
    print(f"\n| {title} | time, {unit} | share of time | p (Holm) | faster |")
    print("|---|---|---|---|---|")
    for name, own in times.items():
        row = [t_interval(list(own.values())).text()
               + (f" ({late[name]} late)" if late[name] else ""), "1", "", ""]
        if name in pairs:
            row[1:] = [*shares[name], f"{pairs[name][0].below} of {len(own)}"]
        print(f"| {name.replace('_', ' ')} |", " | ".join(row), "|")
