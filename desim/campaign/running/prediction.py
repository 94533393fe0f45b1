"""The cost of a campaign, predicted from runs that are done, or from a few probes.

A run costs so many seconds of CPU for each simulated second, which grows with the fleet, and lasts
so many simulated seconds. If only its beginning was run, the start-up cost is added once, and how
much it had explored says how long it would have lasted. All is taken from runs of the same vector;
else from those of the vectors that share most levels with it, with the rate scaled by the size of
the fleet; a run of which nothing is known lasts until its time limit.
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
_TELLING_S, _TELLING = 20.0, 0.02  # simulated, and explored by then
_LAST_CORNERS = 1.3
_OVERHEAD_S = 0.015  # of a run, beside what its manifest says (measured: tools/bench.py campaign)


class Cost(NamedTuple):
    """The cost of one run: seconds of CPU, simulated seconds, and whether it had ended by then.
    ``start_s``: seconds of CPU for the beginning, such as discovery, beside those for each
    simulated second. ``extrapolated_s``: the simulated seconds that all of a run would take that
    had not ended; None: nobody knows."""

    cpu_s: float
    simulated_s: float
    ended: bool
    start_s: float = 0.0
    extrapolated_s: float | None = None

    @property
    def lasts_s(self) -> float | None:
        """The simulated seconds that all of the run takes, if they are known."""
        return self.simulated_s if self.ended else self.extrapolated_s


class Forecast(NamedTuple):
    """Seconds of CPU: expected, and if every run that is left lasts until its time limit
    (and every vector takes all iterations that it may)."""

    expected_s: float
    longest_s: float


def extrapolated_s(explored: float, simulated_s: float, wanted: float) -> float | None:
    """The simulated seconds until the share ``wanted`` is explored, of a run that has ``explored``
    so much; None if it is too early to tell. The last corners take long: measured from 20 to 60 s
    on, 874 runs of 12 campaigns took 1.3 times as long as in proportion (median; half of them 1.0
    to 1.8, four of five 0.8 to 2.7)."""
    if simulated_s < _TELLING_S or explored < _TELLING:
        return None
    return max(_LAST_CORNERS * simulated_s * wanted / explored, simulated_s)


class BySize:
    """A number that some vectors are ``known`` to have: interpolated over the size of the fleet,
    and scaled as those need it that share most levels with the vector in question. Beyond the
    largest known fleet it grows with this ``power`` of the size."""

    def __init__(self, known: list[tuple[Vector, float]], power: int) -> None:
        self._known, self._power = [vector for vector, _ in known], power
        self._numbers = {vector.number: number for vector, number in known}
        by_size: dict[int, list[float]] = {}
        for vector, number in known:
            by_size.setdefault(vector.robots, []).append(number)
        self._sizes = sorted(by_size)
        self._means = [fmean(by_size[size]) for size in self._sizes]

    def of(self, vector: Vector) -> float:
        """The number of any other vector."""
        return self._usual(vector.robots) * fmean(
            self._numbers[near.number] / self._usual(near.robots)
            for near in _nearest(vector, self._known))

    def _usual(self, robots: int) -> float:
        mean = float(np.interp(robots, self._sizes, self._means))
        return max(mean * max(robots / max(self._sizes[-1], 1), 1.0) ** self._power, 1e-9)


class Model:
    """A model of the cost of runs, from known ``costs`` by vector number."""

    def __init__(self, plan: Plan, costs: dict[int, list[Cost]]) -> None:
        known = [vector for vector in plan.vectors if costs.get(vector.number)]
        self._costs = costs
        self._known = known[::-(-len(known) // _MOST_COMPARED) or 1]
        self._rates = BySize([(vector, _rate(costs[vector.number])) for vector in self._known], 1)
        timed = [(vector, fmean(own)) for vector in self._known
                 if (own := _lengths_s(costs[vector.number]))]
        self._lengths = BySize(timed, 0) if timed else None

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
        costs = self._costs.get(vector.number)
        return _rate(costs) if costs else self._rates.of(vector)

    def _lasts_s(self, vector: Vector) -> float:
        own = _lengths_s(self._costs.get(vector.number, []))
        if own or self._lengths is None:
            return fmean(own) if own else vector.limit_s
        return self._lengths.of(vector)


def _rate(costs: list[Cost]) -> float:
    """The seconds of CPU for a simulated second, of runs of one vector."""
    return (sum(cost.cpu_s - cost.start_s for cost in costs)
            / max(sum(cost.simulated_s for cost in costs), 1e-9))


def _lengths_s(costs: list[Cost]) -> list[float]:
    """The known lengths of runs of one vector: of those that have ended, if any."""
    known = [cost for cost in costs if cost.ended] or costs
    return [cost.lasts_s for cost in known if cost.lasts_s is not None]


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
