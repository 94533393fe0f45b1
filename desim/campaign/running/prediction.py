"""The cost of a campaign, predicted from runs that are done, or from a few probes.

A run costs so many seconds of CPU for each simulated second, which grows with the fleet, and lasts
so many simulated seconds. If only its beginning was run, the start-up cost is added once. All is
taken from runs of the same vector; else from those of the vectors that share most levels with it,
with the rate scaled by the size of the fleet; a run of which nothing is known lasts until its time
limit.
"""

from __future__ import annotations

from collections import Counter
from statistics import fmean
from typing import NamedTuple

import numpy as np

from desim.campaign.design.plan import Plan, Vector
from desim.campaign.running.agenda import Agenda
from desim.results.status import RunStatus

_MOST_COMPARED = 64  # vectors: enough to see what matters, few enough for large designs
_OVERHEAD_S = 0.015  # of a run, beside what its manifest says (measured: tools/bench.py campaign)


class Cost(NamedTuple):
    """The cost of one run: seconds of CPU, simulated seconds, and whether it had ended by then.
    ``start_s``: seconds of CPU for the beginning, such as discovery, beside those for each
    simulated second."""

    cpu_s: float
    simulated_s: float
    ended: bool
    start_s: float = 0.0


class Forecast(NamedTuple):
    """Seconds of CPU: expected, and if every run that is left lasts until its time limit
    (and every vector takes all iterations that it may)."""

    expected_s: float
    longest_s: float


class Model:
    """A model of the cost of runs, from known ``costs`` by vector number."""

    def __init__(self, plan: Plan, costs: dict[int, list[Cost]]) -> None:
        known = [vector for vector in plan.vectors if costs.get(vector.number)]
        self._costs = costs
        self._known = known[::-(-len(known) // _MOST_COMPARED) or 1]
        self._ended = [vector for vector in self._known
                       if any(cost.ended for cost in costs[vector.number])]
        by_size: dict[int, list[float]] = {}
        for vector in self._known:
            by_size.setdefault(vector.robots, []).append(self._own_rate(vector))
        self._sizes = sorted(by_size)
        self._rates = [fmean(by_size[size]) for size in self._sizes]

    def expected_s(self, vector: Vector) -> float:
        """The expected seconds of CPU of one run."""
        return self._once_s(vector) + self._rate(vector) * min(self._lasts_s(vector),
                                                               vector.limit_s)

    def longest_s(self, vector: Vector) -> float:
        """The seconds of CPU of one run that lasts until its time limit."""
        return self._once_s(vector) + self._rate(vector) * vector.limit_s

    def _once_s(self, vector: Vector) -> float:
        """The seconds of CPU of a run besides those for each simulated second."""
        alike = [vector] if self._costs.get(vector.number) else _nearest(vector, self._known)
        return _OVERHEAD_S + fmean(cost.start_s for other in alike
                                   for cost in self._costs[other.number])

    def _rate(self, vector: Vector) -> float:
        """The seconds of CPU for a simulated second."""
        if self._costs.get(vector.number):
            return self._own_rate(vector)
        near = _nearest(vector, self._known)
        return self._by_size(vector.robots) * fmean(
            self._own_rate(other) / self._by_size(other.robots) for other in near)

    def _own_rate(self, vector: Vector) -> float:
        costs = self._costs[vector.number]
        return (sum(cost.cpu_s - cost.start_s for cost in costs)
                / max(sum(cost.simulated_s for cost in costs), 1e-9))

    def _by_size(self, robots: int) -> float:
        """The rate by the size of the fleet: interpolated between known sizes; beyond the largest
        one, in proportion."""
        rate = float(np.interp(robots, self._sizes, self._rates))
        return max(rate * max(robots / self._sizes[-1], 1.0), 1e-9)

    def _lasts_s(self, vector: Vector) -> float:
        own = [cost.simulated_s for cost in self._costs.get(vector.number, ()) if cost.ended]
        if own or not self._ended:
            return fmean(own) if own else vector.limit_s
        return fmean(cost.simulated_s for other in _nearest(vector, self._ended)
                     for cost in self._costs[other.number] if cost.ended)


def finished_costs(agenda: Agenda) -> dict[int, list[Cost]]:
    """The costs of the campaign's finished runs, by vector number."""
    costs: dict[int, list[Cost]] = {}
    for vector, _, run_id in agenda.runs:
        row = agenda.rows.get(run_id)
        if row is not None and row["status"] == RunStatus.FINISHED:
            costs.setdefault(vector.number, []).append(
                Cost(row["cost"]["cpu_s"], row["cost"]["simulated_s"], True))
    return costs


def forecast(plan: Plan, agenda: Agenda, costs: dict[int, list[Cost]]) -> Forecast:
    """The forecast of the remaining runs. ``costs``: of at least one vector."""
    model = Model(plan, costs)
    left = Counter(vector.number for vector, _, run_id in agenda.runs if run_id not in agenda.rows)
    return Forecast(sum(count * model.expected_s(plan.vectors[number])
                        for number, count in left.items()),
                    sum(count * model.longest_s(plan.vectors[number])
                        for number, count in agenda.most_left.items() if count))


def _nearest(vector: Vector, others: list[Vector]) -> list[Vector]:
    """The vectors that share most levels with ``vector``."""
    def shared(other: Vector) -> int:
        return sum(other.levels[name].label == level.label
                   for name, level in vector.levels.items())

    most = max(map(shared, others))
    return [other for other in others if shared(other) == most]
