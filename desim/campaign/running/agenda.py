"""The agenda of a campaign: the missing runs, in an order that covers the whole design early."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from desim.campaign.design.design import Until
from desim.campaign.design.plan import Plan, Vector
from desim.campaign.design.quantities import same_unit
from desim.results.row import Row, Rows
from desim.results.status import RunStatus

if TYPE_CHECKING:  # scipy.stats is slow to import, and few designs need it
    import numpy as np

    from desim.statistics.sequential import StoppingRule

Value = Callable[[Row], float | None]

_GOLDEN = 0.6180339887  # its multiples, modulo 1, fill the interval evenly


class Agenda:
    """The runs of a campaign, iteration by iteration over all vectors, in an order that is spread
    over the design: the costs of the first runs soon predict those of large fleets, too. With
    ``iterations: {metric: ..., width: ...}`` a vector gets another iteration when all earlier ones
    are done and its interval is still too wide. So the choice of runs does not depend on the number
    of workers.

    ``rows`` are those of the runs that are done; ``add`` adds one. ``value`` gives a row's value of
    the metric that is to be known well enough. ``runs`` are all that belong to the campaign as far
    as that is known: vector, iteration, id.
    """

    def __init__(self, plan: Plan, rows: Rows, only: tuple[str, ...] = (),
                 value: Value = lambda row: None) -> None:
        self.rows = rows
        self.runs: list[tuple[Vector, int, str]] = []
        self._plan, self._value = plan, value
        self._next = 0  # in runs
        self._vectors_of: dict[str, list[Vector]] = {}  # two may ask for one and the same run
        self._done = self._failed = 0
        vectors = spread([vector for vector in plan.vectors if vector.matches(only)])
        self._ids: dict[int, list[str]] = {vector.number: [] for vector in vectors}
        for iteration in range(plan.least_iterations):
            for vector in vectors:
                self._append(vector, iteration)
        rule = plan.design.iterations
        self._until = stopping_rule(rule) if isinstance(rule, Until) else None
        if self._until:
            self._extend(vectors, self._until)

    @property
    def progress(self) -> tuple[int, int, int]:
        """The number of runs that are done, of those that failed, and of all as far as known; a run
        that two vectors ask for is one."""
        return self._done, self._failed, len(self._vectors_of)

    @property
    def most_left(self) -> dict[int, int]:
        """The most runs of each vector that are still to make, by its number."""
        left = {number: sum(run_id not in self.rows for run_id in ids)
                for number, ids in self._ids.items()}
        if self._until:
            left = {number: count and count + self._until.at_most - len(self._ids[number])
                    for number, count in left.items()}
        return left

    @property
    def wide(self) -> list[Vector]:
        """The vectors that are not known well enough after all iterations that they may have."""
        if not self._until:
            return []
        return [vector for vector in self._plan.vectors
                if len(ids := self._ids.get(vector.number, [])) >= self._until.at_most
                and all(run_id in self.rows for run_id in ids)
                and not is_narrow(self._known(ids), self._until)]

    def __contains__(self, run_id: str) -> bool:
        """Whether the run belongs to the campaign."""
        return run_id in self._vectors_of

    def next(self) -> tuple[Vector, int, str] | None:
        """A run to begin with now; None if there is none, yet or at all."""
        while self._next < len(self.runs):
            vector, iteration, run_id = self.runs[self._next]
            self._next += 1
            if self._vectors_of[run_id][0] is vector and run_id not in self.rows:
                return vector, iteration, run_id
        return None

    def add(self, row: Row) -> None:
        """Add the row of a run that has ended."""
        self.rows[row["run_id"]] = row
        self._count(row)
        if self._until:
            self._extend(self._vectors_of[row["run_id"]], self._until)

    def _append(self, vector: Vector, iteration: int) -> None:
        run_id = self._plan.run_id(vector, iteration)
        self.runs.append((vector, iteration, run_id))
        self._ids[vector.number].append(run_id)
        vectors = self._vectors_of.setdefault(run_id, [])
        vectors.append(vector)
        if len(vectors) == 1 and run_id in self.rows:
            self._count(self.rows[run_id])

    def _count(self, row: Row) -> None:
        self._done += 1
        self._failed += row["status"] == RunStatus.FAILED

    def _extend(self, vectors: list[Vector], rule: StoppingRule) -> None:
        """Append iterations of each of the ``vectors`` that is not known well enough."""
        from desim.statistics.sequential import enough

        for vector in vectors:
            ids = self._ids[vector.number]
            while (len(ids) < rule.at_most and all(run_id in self.rows for run_id in ids)
                   and not enough(self._known(ids), *rule)):
                self._append(vector, len(ids))

    def _known(self, ids: list[str]) -> list[float]:
        """The metric's values, of those runs that have one."""
        values = [self._value(self.rows[run_id]) for run_id in ids]
        return [float(value) for value in values if value is not None]


def spread(vectors: Sequence[Vector]) -> list[Vector]:
    """The vectors in an order of which each beginning covers all of them evenly."""
    order = sorted(range(len(vectors)), key=lambda place: place * _GOLDEN % 1)
    return [vectors[place] for place in order]


def is_narrow(values: Sequence[float] | np.ndarray, rule: StoppingRule) -> bool:
    """Whether the interval of all known values is as narrow as the rule wants."""
    from desim.statistics.sequential import enough

    return len(values) >= 2 and enough(values, rule.width, rule.relative, 2, len(values) + 1)


def stopping_rule(until: Until) -> StoppingRule:
    """The rule by which a vector's iterations suffice; its width is that of half the interval."""
    from desim.statistics.sequential import StoppingRule

    width, = same_unit(until.width)
    relative = width.unit == "%"
    return StoppingRule(float(width.number) / (200 if relative else 2), relative, until.at_least,
                until.at_most)
