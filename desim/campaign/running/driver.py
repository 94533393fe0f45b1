"""The driver of a campaign: it predicts the cost, makes the workers, and runs the sweep on them."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from desim.campaign.design.plan import Plan
from desim.campaign.design.rehearsal import Made, here
from desim.campaign.running import probes
from desim.campaign.running.agenda import Agenda
from desim.campaign.running.cluster_settings import Local, Queue, Settings
from desim.campaign.running.crew import Crew
from desim.campaign.running.prediction import Cost, Forecast, finished_costs, forecast
from desim.campaign.running.sweep import LOGS, Sweep, Workers
from desim.campaign.running.work import RunTask
from desim.operating_system.resources import cores
from desim.results.row import Row

_FORECAST_EVERY_S = 3.0  # it takes up to 0.1 s for a campaign of thousands of runs


def predicted(plan: Plan, agenda: Agenda, probing: Callable[[int, int], object],
              tried: dict[int, str | None], made: Made = here,
              ) -> tuple[Forecast | None, list[Cost], bool]:
    """The cost of the remaining runs, the costs of the runs that this rests on, and whether these
    are probes: they are where no run has finished yet. None where every probe has failed.
    ``probing`` is called with the numbers of probes done and of all probes; ``tried`` gets the
    errors of probes, as ``probed`` says. ``made`` does a probe, as ``Metrics`` says."""
    finished = finished_costs(agenda)
    costs = finished or probes.probed(plan, agenda, probes.BUDGET_S, probing, tried, made)
    return (forecast(plan, agenda, costs) if costs else None,
            [cost for own in costs.values() for cost in own], not finished)


class CampaignDriver:
    """Makes a campaign's missing runs, in ``jobs`` processes of this machine (by default one for
    each core) or on a cluster; no more processes, or jobs, than there are runs to make. ``where``
    says which, in words."""

    def __init__(self, sweep: Sweep, jobs: int | None, cluster: Settings | None) -> None:
        done, _, total = sweep.agenda.progress
        missing = max(total - done, 1)
        self._sweep, self._jobs = sweep, min(jobs or cores(), missing)
        if isinstance(cluster, Local | Queue):
            cluster = cluster.model_copy(update={"jobs": min(cluster.jobs or cores(), missing)})
        self._cluster = cluster
        self.where = f"{self._jobs} at a time" if cluster is None else cluster.where

    def run(self, run_ended: Callable[[Row], object], workers_up: Callable[[int], object],
            slow: Callable[[str, float], object] = lambda run_id, seconds: None) -> None:
        """Run the campaign to its end. ``run_ended`` is called with each run's row, ``workers_up``
        with the number of a cluster's workers when that changes, ``slow`` as ``Crew`` says.
        Raises ``KeyboardInterrupt`` with how far the campaign came, and ``InputError``."""
        with self._workers(workers_up, slow) as workers:
            try:
                self._sweep.run(workers, run_ended)
            except KeyboardInterrupt:
                done, _, total = self._sweep.agenda.progress
                raise KeyboardInterrupt(f"{done} of {total} runs in {self._sweep.out}; the same "
                                        "command goes on from there") from None

    @contextmanager
    def _workers(self, workers_up: Callable[[int], object],
                 slow: Callable[[str, float], object]) -> Iterator[Workers]:
        wall_ns = self._sweep.plan.design.limits.wall_ns
        if self._cluster is None:
            crew: Crew[RunTask] = Crew(self._jobs, wall_ns, self._sweep.out / LOGS, slow)
            with crew:
                yield crew
            return
        # Few have Dask, and to import it takes seconds.
        from desim.campaign.running.cluster import Cluster
        from desim.campaign.running.schedulers import connected

        with connected(self._cluster) as client:
            yield Cluster(client, workers_up, wall_ns)


class TimeLeft:
    """The time until a campaign ends: the predicted cost of its remaining runs, at the pace that it
    has had since its first run was done."""

    def __init__(self, sweep: Sweep) -> None:
        self._sweep = sweep
        self._begin_s: float | None = None
        self._spent_s, self._end_s, self._next_s = 0.0, 0.0, 0.0

    def after(self, row: Row) -> float | None:
        """The seconds left when a run has ended; None while they are unknown."""
        now_s = time.monotonic()
        if self._begin_s is None:
            self._begin_s = now_s
            return None
        self._spent_s += row.get("cost", {}).get("cpu_s", 0.0)
        if self._spent_s and now_s >= self._next_s:
            self._next_s = now_s + _FORECAST_EVERY_S
            agenda = self._sweep.agenda
            left_s = forecast(self._sweep.plan, agenda, finished_costs(agenda)).expected_s
            self._end_s = now_s + left_s * (now_s - self._begin_s) / self._spent_s
        return max(self._end_s - now_s, 0.0) if self._next_s else None
