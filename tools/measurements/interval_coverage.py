"""How often do the intervals of desim/statistics hold the truth? Measured by simulation.

    python tools/measurements/interval_coverage.py [--experiments 2000]

One line for each interval: the distribution, the share of intervals (nominally 95 %) that contain
the truth, the standard error of that share. This is the table of docs/reports.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator

import numpy as np

from desim.statistics.censoring import median_time, restricted_mean
from desim.statistics.intervals import bca_interval, t_interval
from desim.statistics.knee import breakpoint_of
from desim.statistics.sequential import StoppingRule, coverage_of
from desim.statistics.two_knees import knees_of

LIMIT = 1.2  # of exponential times with mean 1: stops 30 % of the runs

STEP = 3.6, 7.3  # bends of a line

Bounds = tuple[float | None, float | None]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--experiments", type=int, default=2000)
    experiments = parser.parse_args().experiments
    for what, truth, bounds in cases():
        share = np.mean([held(truth, bounds(number)) for number in range(experiments)])
        error = (share * (1 - share) / experiments)**0.5
        print(f"{what:58} {100 * share:5.1f} % +- {100 * error:.1f} %", flush=True)
    for rule in (StoppingRule(0.5), StoppingRule(0.5, at_least=10), StoppingRule(0.3),
                 StoppingRule(0.2)):
        found = coverage_of(rule)
        what = f"t, half width {rule.width} deviations, {rule.at_least} to {rule.at_most} values"
        print(f"{what:58} {100 * found.share:5.1f} % +- {100 * found.error:.1f} %, "
              f"stopped after {found.mean_n:.0f}")


def two_peaked(draw: np.random.Generator, n: int) -> np.ndarray:
    """One of five runs is far from the others, as one that misses a door is."""
    return (draw.random(n) < 0.2) + 0.02 * draw.standard_normal(n)


def held(truth: float, bounds: Bounds) -> bool:
    low, high = bounds
    return (low is None or low <= truth) and (high is None or truth <= high)


def cases() -> Iterator[tuple[str, float, Callable[[int], Bounds]]]:
    """The distribution, the truth, and a function that gives the bounds of experiment k."""
    draws = {"normal": (0.0, np.random.Generator.standard_normal),
             "exponential": (1.0, np.random.Generator.standard_exponential),
             "lognormal": (np.exp(0.5), lambda draw, n: draw.lognormal(size=n)),
             "two-peaked": (0.2, two_peaked)}
    for n, names in ((5, ["normal", "two-peaked"]), (10, ["normal", "two-peaked"]),
                     (20, ["two-peaked"]), (30, list(draws)), (100, list(draws))):
        for name in names:
            mean, values = draws[name]
            yield (f"t, {n} {name} values", mean,
                   lambda k, n=n, f=values: t_interval(f(generator(k), n))[1:3])
            if n >= 30:
                yield (f"BCa, {n} {name} values", mean,
                       lambda k, n=n, f=values: bca_interval(f(generator(k), n), seed=k,
                                                             resamples=1999)[1:3])
    for n in (5, 10, 30):
        yield (f"median, {n} exponential times, 30 % censored", np.log(2),
               lambda k, n=n: median_time(*stopped(k, n))[1:3])
        yield (f"restricted mean, {n} exponential times, 30 % censored", 1 - np.exp(-LIMIT),
               lambda k, n=n: restricted_mean(*stopped(k, n), LIMIT)[2:4])
    for knee, seeds in ((6.0, 10), (6.3, 10), (6.0, 1), (6.3, 1)):
        yield (f"knee at {knee}, {seeds} runs at each load of 1 to 10", knee,
               lambda k, at=knee, seeds=seeds: bend(k, at, seeds))
    for which, at in enumerate(STEP):
        yield (f"{('first', 'second')[which]} of two bends, at {at}, 10 runs at each of 1 to 10",
               at, lambda k, which=which: step(k)[which])


def step(number: int) -> list[Bounds]:
    """Flat, falling, flat."""
    loads = np.repeat(np.arange(1.0, 11.0), 10)
    metric = -2 * np.clip(loads, *STEP) + generator(number).normal(size=100) * 0.5
    return [found[1:3] for found in knees_of(loads, metric, seed=number, resamples=499)]


def generator(number: int) -> np.random.Generator:
    return np.random.default_rng(number)


def stopped(number: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    times = generator(number).exponential(1.0, n)
    return np.minimum(times, LIMIT), times <= LIMIT


def bend(number: int, at: float, seeds: int) -> Bounds:
    """Scatter grows with the runs, so that they know as much of the knee together."""
    loads = np.repeat(np.arange(1.0, 11.0), seeds)
    metric = np.minimum(loads, at) + generator(number).normal(0.0, 0.16 * seeds**0.5, len(loads))
    return breakpoint_of(loads, metric, seed=number, resamples=499)[1:3]


if __name__ == "__main__":
    main()
