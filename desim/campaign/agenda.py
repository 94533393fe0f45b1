"""Which run is next: what a plan still lacks, in an order that covers the whole design early."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

from desim.campaign.design import Until
from desim.campaign.plan import Plan, Vector
from desim.campaign.quantities import quantity
from desim.campaign.work import Row

Rows = dict[str, Row]
Value = Callable[[Row], Any]


class Agenda:
    """Iteration by iteration over all vectors. With ``iterations: {until: ...}`` a vector asks for
    its next iteration when those before it are known and do not suffice: what is run does not
    depend on how many work.

    ``rows`` are those of the runs that are done, and grows from outside; ``value`` gives a row's
    value of the metric that is to be known well enough.
    """

    def __init__(self, plan: Plan, rows: Rows, only: tuple[str, ...] = (),
                 value: Value | None = None) -> None:
        self._plan, self._rows, self._value = plan, rows, value
        self._begun: set[str] = set()
        vectors = [vector for vector in plan.vectors if _matches(vector, only)]
        self._left = deque((vector, iteration) for iteration in range(plan.least_iterations)
                           for vector in vectors)
        self._vectors = vectors
        self._count = dict.fromkeys((vector.number for vector in vectors), plan.least_iterations)

    @property
    def runs(self) -> list[tuple[Vector, int, str]]:
        """Every run that belongs to the campaign as far as that is known: vector, iteration, id."""
        return [(vector, iteration, self._plan.run_id(vector, iteration))
                for vector in self._vectors for iteration in range(self._count[vector.number])]

    def next(self) -> tuple[Vector, int, str] | None:
        """A run to begin with now; None if there is none, yet or at all."""
        while self._left or self._extend():
            vector, iteration = self._left.popleft()
            run_id = self._plan.run_id(vector, iteration)
            if run_id not in self._rows and run_id not in self._begun:
                self._begun.add(run_id)
                return vector, iteration, run_id
        return None

    def _extend(self) -> bool:
        """Another iteration of each vector that is not known well enough; whether there are any."""
        rule = self._plan.design.iterations
        if isinstance(rule, Until):
            for vector in self._vectors:
                count = self._count[vector.number]
                if count < rule.at_most and self._lacks(vector, count, rule):
                    self._left.append((vector, count))
                    self._count[vector.number] = count + 1
        return bool(self._left)

    def _lacks(self, vector: Vector, count: int, rule: Until) -> bool:
        from desim.statistics.sequential import enough

        ids = [self._plan.run_id(vector, iteration) for iteration in range(count)]
        if not all(run_id in self._rows for run_id in ids):
            return False
        values = [self._value(self._rows[run_id]) for run_id in ids]
        width = quantity(rule.width)
        known = [float(value) for value in values if value is not None]
        return not enough(known, float(width.number) / (100 if width.unit == "%" else 1),
                          relative=width.unit == "%", at_least=rule.at_least,
                          at_most=rule.at_most)


def _matches(vector: Vector, only: tuple[str, ...]) -> bool:
    """Whether it has one of the wanted levels of each parameter: ``robots=8``."""
    wanted: dict[str, set[str]] = {}
    for text in only:
        name, _, label = text.partition("=")
        wanted.setdefault(name.strip(), set()).add(label.strip())
    return all(vector.levels[name].label in labels for name, labels in wanted.items())

