"""How a campaign is getting on."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from desim.campaign.agenda import Agenda
from desim.campaign.campaign import INDEX, TABLE, Sweep, Workers
from desim.campaign.clustersettings import Settings
from desim.campaign.crew import Crew
from desim.campaign.design import LoadedDesign
from desim.campaign.plan import Plan
from desim.campaign.work import Row

LINE_EVERY_S = 10.0  # where there is no terminal
_MANY = 200  # scenarios take a while to check


class Told:
    """What people are told while a campaign is planned and run; nothing if ``quiet``."""

    def __init__(self, quiet: bool) -> None:
        self._console = Console(quiet=quiet, highlight=False, soft_wrap=True)

    def planned(self, loaded: LoadedDesign) -> Plan:
        """The plan of a design."""
        with self._progress() as progress:
            bar = progress.add_task("checking scenarios", total=None, visible=False,
                                    failed="")
            return Plan(loaded, lambda done, total: progress.update(
                bar, completed=done, total=total, visible=total > _MANY))

    def listed(self, agenda: Agenda) -> None:
        """Every run, and how it stands."""
        for vector, iteration, run_id in agenda.runs:
            levels = ", ".join(f"{name}={level.label}" for name, level in vector.levels.items())
            state = agenda.rows[run_id]["status"] if run_id in agenda.rows else "to run"
            self._console.print(f"{run_id}  {state:8}  {levels}, iteration {iteration}")
        done, failed, total = agenda.progress
        self._console.print(f"{total} runs, {done} done, {failed} of them failed")

    def carried_out(self, sweep: Sweep, jobs: int | None, cluster: Settings | None) -> None:
        """Run the campaign on this machine, or on a cluster."""
        if sweep.damaged:
            self._console.print(f"{sweep.out / INDEX}: {sweep.damaged} lines could not be read; it "
                                "was made again from the folders of the runs")
        if sweep.others:
            self._console.print(f"{sweep.out}: {sweep.others} runs of an earlier design, another "
                                "scenario or another version of desim; they stay, but are not in "
                                "the table")
        done, failed, total = sweep.progress
        jobs = min(jobs or _cores(), max(total - done, 1))
        where = f"{jobs} at a time" if cluster is None else f"{cluster.where}"
        self._console.print(f"{total} runs, {done} done already; {where}, in {sweep.out}")
        with self._progress() as progress, ExitStack() as stack:
            bar = progress.add_task("runs", total=total, completed=done, failed=_failed(failed))
            lines = _Lines(self._console)
            if cluster is None:
                workers: Workers = stack.enter_context(Crew(jobs))
            else:
                workers = stack.enter_context(self._clustered(cluster, progress, bar))

            def heard(row: Row) -> None:
                done, failed, total = sweep.progress
                progress.update(bar, completed=done, total=total, failed=_failed(failed))
                lines.tell(f"{done} of {total} runs{_failed(failed)}")
                if row["status"] == "failed":
                    progress.console.print(f"{row['run_id']} failed: {row['error']}")

            sweep.run(workers, heard)
        done, failed, total = sweep.progress
        self._console.print(f"{done} of {total} runs{_failed(failed)}; table: "
                            f"{sweep.out / TABLE}")

    @contextmanager
    def _clustered(self, settings: Settings, progress: Progress, bar: TaskID) -> Iterator[Workers]:
        """Dask is imported only here: few have it, and it takes its time."""
        from desim.campaign.cluster import Cluster
        from desim.campaign.schedulers import connected

        def up(count: int) -> None:
            text = f"{count} worker{'s' * (count != 1)} up"
            progress.update(bar, description=f"runs, {text}")
            if not self._console.is_terminal:
                self._console.print(text)

        with connected(settings, _cores()) as client:
            yield Cluster(client, up)

    def _progress(self) -> Progress:
        return Progress(TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(),
                        TextColumn("{task.fields[failed]}"), TimeElapsedColumn(),
                        TextColumn("to go"), TimeRemainingColumn(), console=self._console,
                        transient=True, disable=not self._console.is_terminal)


class _Lines:
    """A line now and then, for logs."""

    def __init__(self, console: Console) -> None:
        self._console, self._next_s = console, time.monotonic() + LINE_EVERY_S

    def tell(self, text: str) -> None:
        if not self._console.is_terminal and time.monotonic() >= self._next_s:
            self._console.print(text)
            self._next_s = time.monotonic() + LINE_EVERY_S


def _failed(count: int) -> str:
    return f", {count} failed" if count else ""


def _cores() -> int:
    return len(os.sched_getaffinity(0))

