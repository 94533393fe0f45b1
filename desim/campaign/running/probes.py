"""Probes: a few runs of a design, made only to measure their cost."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Timer
from time import process_time
from typing import NamedTuple

from desim import api
from desim.blame import blame
from desim.campaign.design.plan import Plan, Vector
from desim.campaign.design.rehearsal import Made, here
from desim.campaign.running.agenda import Agenda, spread
from desim.campaign.running.prediction import Cost, extrapolated_s
from desim.errors import InputError
from desim.results.folder import RunFolder
from desim.results.row import Row, failure
from desim.results.run import Run
from desim.results.status import RunStatus
from desim.scenario.load import Loaded
from desim.scenario.schema.scenario import Scenario
from desim.simulation.simulation import Simulation
from desim.units import NS_PER_S

BUDGET_S = 20.0  # as long as a person waits for an answer
_MOST_PROBES = 8  # of 2.5 s each: shorter ones see little more than the beginning
_SHARE = 10  # runs for each probe: what predicts takes about a tenth of what it predicts
_EXPLORED = {"any": "explored", "union": "explored_union", "all": "explored_all"}  # by stop.by


def probed(plan: Plan, agenda: Agenda, budget_s: float = BUDGET_S,
           probing: Callable[[int, int], object] = lambda done, total: None,
           tried: dict[int, str | None] | None = None, made: Made = here,
           ) -> dict[int, list[Cost]]:
    """The costs, by vector number, of probes: one for each ten missing runs, of vectors that are
    spread over the design, small fleets first. Together they take ``budget_s``: each is stopped
    when its share of the rest is used up. A probe that fails has no cost. ``tried`` gets its
    error, or None, by vector number. ``made`` does it, as ``Metrics`` says."""
    left = [vector.number for vector, _, run_id in agenda.runs if run_id not in agenda.rows]
    vectors = _spread([plan.vectors[number] for number in dict.fromkeys(left)],
                      min(_MOST_PROBES, max(len(left) // _SHARE, 1)))
    costs: dict[int, list[Cost]] = {}
    for done, vector in enumerate(vectors):
        probing(done, len(vectors))
        row = made(Probe(plan.run_id(vector, 0), plan.scenario(vector, 0),
                         budget_s / (len(vectors) - done)))
        if tried is not None:
            tried[vector.number] = row.get("error")
        if row["status"] == RunStatus.FAILED:  # a run that fails is a result, but none of these
            continue
        cost = Cost(*row["cost"])
        costs[vector.number] = [cost]
        budget_s -= min(cost.cpu_s, budget_s)
    return costs


class Probe(NamedTuple):
    """The task of one probe."""

    run_id: str
    loaded: Loaded
    budget_s: float

    def made(self) -> Row:
        try:
            cost = _probe(self.loaded, self.budget_s)
        except InputError as error:
            return failure(self.run_id, str(error))
        except (Exception, KeyboardInterrupt) as error:  # of a model or a plug-in
            return failure(self.run_id, blame(error).line)
        return {"run_id": self.run_id, "status": RunStatus.FINISHED.value, "cost": cost}


def _probe(loaded: Loaded, budget_s: float) -> Cost:
    """The cost of one probe. Its rate is that of the second half of its time: the beginning may
    cost more."""
    due = Event()
    # CPU, simulated s: at the beginning, at half of the time (unless its timer is late), at the end
    marks: list[tuple[float, float]] = []

    @contextmanager
    def limited(simulation: Simulation, _: RunFolder) -> Iterator[None]:
        def mark() -> None:
            marks.append((process_time(), simulation.kernel.now_ns / NS_PER_S))

        def stop() -> None:
            due.set()
            simulation.interrupt()

        mark()
        timers = Timer(budget_s / 2, mark), Timer(budget_s, stop)
        for timer in timers:
            timer.start()
        try:
            yield
        finally:
            for timer in timers:
                timer.cancel()
        mark()

    with tempfile.TemporaryDirectory() as folder:
        try:
            run = api.run(loaded, out=folder, watch=limited)
        except KeyboardInterrupt as stopped:
            if not due.is_set():
                raise
            run = Run(str(stopped))
        cpu_s, simulated_s = run.manifest["cpu_s"], run.manifest["simulated_s"]
        if run.manifest["status"] == RunStatus.FINISHED:
            return Cost(cpu_s, simulated_s, True)
        return Cost(cpu_s, simulated_s, False, _start_s(cpu_s, simulated_s, marks),
                    _whole_s(loaded.scenario, run))


def _whole_s(scenario: Scenario, run: Run) -> float | None:
    """``Cost.extrapolated_s`` of a run that was stopped while it explored."""
    stop = scenario.stop
    if scenario.task.model != "exploration" or stop.by == "none":
        return None
    return extrapolated_s(run.metrics[_EXPLORED[stop.by]], run.manifest["simulated_s"],
                          stop.explored)


def _start_s(cpu_s: float, simulated_s: float, marks: list[tuple[float, float]]) -> float:
    """``Cost.start_s`` of a run that was stopped: its time beyond the rate between the last two
    ``marks``."""
    *_, (half_cpu_s, half_s), (end_cpu_s, end_s) = marks
    if end_s <= half_s:
        return 0.0
    rate = (end_cpu_s - half_cpu_s) / (end_s - half_s)
    return max(cpu_s - rate * simulated_s, 0.0)


def _spread(vectors: list[Vector], most: int) -> list[Vector]:
    """Some vectors by ascending fleet, the largest fleet among them; one alone has the middle
    fleet."""
    if most == 1:
        return [sorted(vectors, key=lambda vector: vector.robots)[len(vectors) // 2]]
    largest = max(vectors, key=lambda vector: vector.robots)
    others = [vector for vector in spread(vectors) if vector is not largest]
    return sorted([largest, *others[:most - 1]], key=lambda vector: vector.robots)
