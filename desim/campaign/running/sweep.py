"""The sweep: a campaign's missing runs are made, and its folder is kept.

``<out>/`` holds ``design.yaml``, ``runs/<scenario>/<run id>/``, ``index.jsonl``,
``runs.parquet``, and ``output/<run id>.log`` of a run that printed something. A run is
finished when its folder is in place; everything else follows from the folders, so
that a campaign that was killed goes on where it was.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

from desim.campaign.design.design import Until
from desim.campaign.design.metrics import Metrics
from desim.campaign.design.plan import Plan
from desim.campaign.folder.design_copy import refuse_another, store
from desim.campaign.folder.index import Index, read, recovered
from desim.campaign.folder.run_folders import Folders
from desim.campaign.folder.table import write_table
from desim.campaign.running.agenda import Agenda
from desim.campaign.running.work import RunTask
from desim.errors import InputError, did_you_mean
from desim.files import refuse_link
from desim.operating_system.locks import Lock, Taken
from desim.results.row import Row, Rows
from desim.results.status import RunStatus

INDEX, RUNS, TABLE, LOGS = "index.jsonl", "runs", "runs.parquet", "output"


class Workers(Protocol):
    """The workers that run tasks: a ``Crew`` of this machine's processes, or a cluster."""

    @property
    def has_idle_worker(self) -> bool:
        """Whether a worker is idle."""

    @property
    def is_busy(self) -> bool:
        """Whether a worker is at work."""

    def begin(self, task: RunTask) -> None:
        """Begin a task; a worker is idle."""

    def finished(self) -> list[tuple[RunTask, Row | Exception]]:
        """Wait for tasks to end. Returns their rows, or the error that ends the campaign."""


class Sweep:
    """One campaign being run in ``out``. Use it as a context, which locks the folder.

    ``agenda`` tells how far it is. Raises ``InputError`` where the folder cannot be written, or
    another process runs the campaign.
    """

    def __init__(self, plan: Plan, metrics: Metrics, out: Path, *, only: tuple[str, ...] = (),
                 retry_failed: bool = False) -> None:
        self.plan, self.metrics, self.out = plan, metrics, out
        self._only, self._retry_failed = only, retry_failed
        self._folders = _folders(plan, metrics, out)

    def __enter__(self) -> Sweep:
        place = self._folders.place
        with _writing(self.out):
            for link in (place.parent, place):
                refuse_link(link)
        try:
            place.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{self.out}: cannot be a campaign's folder: {error.strerror}; choose "
                             "another one with --out") from error
        with _writing(self.out):
            try:
                self._lock = Lock(self.out / ".lock")
            except Taken:
                raise InputError(f"{self.out}: another process is running this campaign") from None
            store(self.plan.loaded, self.out)
            self.index = Index(self.out / INDEX)
            self._wrong = self.index.recover(self._folders)
            # Whether there were runs and no index of them: it was made again from their folders.
            self.index_was_lost = self.index.lost and bool(self.index.rows)
        self.agenda = _agenda(self.plan, self.metrics, self.index.rows, self._only,
                              self._retry_failed)
        return self

    def __exit__(self, *_: object) -> None:
        self.index.close()
        self._lock.release()

    @property
    def damaged_runs(self) -> dict[str, str]:
        """The damage of folders whose runs are made again, by run id."""
        return {run_id: wrong for run_id, wrong in self._wrong.items() if run_id in self.agenda}

    @property
    def others(self) -> int:
        """The number of runs in the folder that do not belong to the campaign: of an earlier
        design, another scenario or another version of desim."""
        return 0 if self._only else sum(run_id not in self.agenda for run_id in self.index.rows)

    def run(self, workers: Workers, run_ended: Callable[[Row], object] = lambda row: None) -> None:
        """Make the missing runs; ``run_ended`` is called with the row of each. The table is written
        at the end, whatever the end is. Raises ``InputError`` where results cannot be written."""
        try:
            while True:
                while workers.has_idle_worker and (task := self._next()) is not None:
                    workers.begin(task)
                if not workers.is_busy:
                    return
                for _, outcome in workers.finished():
                    if isinstance(outcome, Exception):
                        raise outcome
                    with _writing(self.out):
                        self.index.add(outcome)
                    self.agenda.add(outcome)
                    run_ended(outcome)
        finally:
            with _writing(self.out):
                write_table(self.out / TABLE, self.plan, self.metrics, self.agenda.rows,
                            self.agenda.runs)

    def _next(self) -> RunTask | None:
        if (run := self.agenda.next()) is None:
            return None
        vector, iteration, run_id = run
        return RunTask(run_id, self.plan.scenario(vector, iteration),
                       os.path.abspath(self.out / RUNS), self.metrics.functions)


@contextmanager
def _writing(out: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        file = f"{os.path.basename(error.filename)}: " if error.filename else ""
        raise InputError(f"cannot write to {out}: {file}{error.strerror or error}; what is "
                         "finished stays, and the same command goes on from there") from error


def _folders(plan: Plan, metrics: Metrics, out: Path) -> Folders:
    """The folders of the runs; all vectors share the scenario's name."""
    return Folders(out / RUNS / plan.scenario(plan.vectors[0], 0).scenario.name, metrics.functions)


def foreseen(plan: Plan, metrics: Metrics, out: Path, only: tuple[str, ...] = (),
             retry_failed: bool = False) -> Agenda:
    """The agenda that a sweep would have now; nothing is written. Raises ``InputError`` as a sweep
    does."""
    refuse_another(plan.loaded, out)
    try:
        rows = read(out / INDEX)[0]
    except OSError as error:
        raise InputError(f"cannot read {out / INDEX}: {error.strerror or error}") from error
    rows, _ = recovered(rows, _folders(plan, metrics, out))
    return _agenda(plan, metrics, rows, only, retry_failed)


def _agenda(plan: Plan, metrics: Metrics, rows: Rows, only: tuple[str, ...],
            retry_failed: bool) -> Agenda:
    if retry_failed:
        rows = {run_id: row for run_id, row in rows.items() if row["status"] != RunStatus.FAILED}
    rule = plan.design.iterations
    if not isinstance(rule, Until):
        return Agenda(plan, rows, only)
    return Agenda(plan, rows, only, lambda row: metrics.value(rule.metric, row))


def selected(plan: Plan, only: tuple[str, ...]) -> tuple[str, ...]:
    """``only``, if every one of them is ``parameter=level`` of the plan. Raises ``InputError``."""
    for text in only:
        name, equals, label = map(str.strip, text.partition("="))
        if not equals or name not in plan.parameters:
            raise InputError(f"--only {text}: must be PARAMETER=LEVEL; parameters: "
                             f"{', '.join(plan.parameters) or 'none'}")
        labels = dict.fromkeys(vector.levels[name].label for vector in plan.vectors)
        if label not in labels:
            raise InputError(f"--only {text}: {name} has no level {label!r}"
                             f"{did_you_mean(label, labels)}; allowed: {', '.join(labels)}")
    if not any(vector.matches(only) for vector in plan.vectors):
        raise InputError(f"--only {' --only '.join(only)}: no vector has these levels together")
    return only
