"""How a campaign is getting on."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
)

from desim.blame import cause_of
from desim.campaign.design.design import LoadedDesign
from desim.campaign.design.plan import Plan
from desim.campaign.running import probes
from desim.campaign.running.agenda import Agenda
from desim.campaign.running.cluster_settings import Settings
from desim.campaign.running.crew import Crew
from desim.campaign.running.prediction import finished_costs, forecast
from desim.campaign.running.sweep import INDEX, TABLE, Sweep, Workers
from desim.commands.views.terminal import Terminal
from desim.results.folder import FAILED
from desim.results.row import Row

LINE_EVERY_S = 10.0  # where there is no terminal
_AGAIN_S = 3.0
_MOST_DAMAGED = 10  # runs that are named
_MOST_CAUSES = 10
_MANY = 200  # scenarios take a while to check


class Told:
    """What people are told while a campaign is planned and run; nothing if ``quiet``."""

    def __init__(self, quiet: bool) -> None:
        self._console = Terminal(quiet=quiet, highlight=False, soft_wrap=True, markup=False,
                                emoji=False)  # labels are text

    def planned(self, loaded: LoadedDesign) -> Plan:
        """The plan of a design."""
        with self._progress() as progress:
            bar = progress.add_task("checking scenarios", total=None, visible=False,
                                    failed="", to_go="")
            return Plan(loaded, lambda done, total: progress.update(
                bar, completed=done, total=total, visible=total > _MANY))

    def listed(self, plan: Plan, agenda: Agenda, jobs: int | None) -> None:
        """Every run, how it stands, and how long those take that are to be made."""
        for vector, iteration, run_id in agenda.runs:
            levels = ", ".join(f"{name}={level.label}" for name, level in vector.levels.items())
            state = agenda.rows[run_id]["status"] if run_id in agenda.rows else "to run"
            self._console.print(f"{run_id}  {state:8}  {levels}, iteration {iteration}")
        done, failed, total = agenda.progress
        self._console.print(f"{total} runs, {done} done, {failed} of them failed")
        if done < total:
            self._predicted(plan, agenda, jobs or _cores())

    def _predicted(self, plan: Plan, agenda: Agenda, jobs: int) -> None:
        costs = finished_costs(agenda)
        source = f"from {sum(map(len, costs.values()))} finished runs"
        if not costs:
            with self._progress() as progress:
                bar = progress.add_task(f"probing, {probes.BUDGET_S:.0f} s at most", failed="",
                                        to_go="")
                costs = probes.probed(plan, agenda, told=lambda done, total: progress.update(
                    bar, completed=done, total=total))
            found = [cost for own in costs.values() for cost in own]
            source = (f"from {len(found)} probe{'s' * (len(found) > 1)} of "
                      f"{sum(cost.cpu_s for cost in found):.1f} s, "
                      f"{sum(cost.ended for cost in found)} of them to the end")
        if not costs:
            self._console.print("no prediction: every probe has failed")
            return
        found = forecast(plan, agenda, costs)
        self._console.print(f"{_duration(found.expected_s)} of CPU are to be expected ({source}), "
                            f"{_duration(found.expected_s / jobs)} with {jobs} jobs on cores of "
                            f"their own; at most {_duration(found.longest_s / jobs)}, every run to "
                            "its time limit")

    def carried_out(self, sweep: Sweep, jobs: int | None, cluster: Settings | None) -> int:
        """Run the campaign on this machine, or on a cluster; how many of its runs failed."""
        if sweep.damaged:
            self._console.print(f"{sweep.out / INDEX}: {sweep.damaged} lines could not be read; it "
                                "was made again from the folders of the runs")
        if sweep.index_was_lost:
            self._console.print(f"{sweep.out / INDEX}: was not there; it was made again from the "
                                "folders of the runs")
        if sweep.damaged_runs:
            self._told_damage(sweep.damaged_runs)
        if sweep.others:
            self._console.print(f"{sweep.out}: {sweep.others} runs of an earlier design, another "
                                "scenario or another version of desim; they stay, but are not in "
                                "the table")
        done, failed, total = sweep.progress
        jobs = min(jobs or _cores(), max(total - done, 1))
        limits = sweep.plan.design.limits
        where = f"{jobs} at a time" if cluster is None else f"{cluster.where}"
        self._console.print(f"{total} runs, {done} done already; {where}, in {sweep.out}")
        with self._progress() as progress, ExitStack() as stack:
            bar = progress.add_task("runs", total=total, completed=done, failed=_failed(failed),
                                    to_go="")
            lines, to_go = _Lines(self._console), _ToGo(sweep)
            errors: set[str] = set()  # each is told once, the others are counted
            if cluster is None:
                workers: Workers = stack.enter_context(Crew(jobs, limits.wall_ns))
            else:
                workers = stack.enter_context(self._clustered(
                    cluster, progress, bar, limits.wall_ns))

            def heard(row: Row) -> None:
                done, failed, total = sweep.progress
                left = to_go.after(row)
                progress.update(bar, completed=done, total=total, failed=_failed(failed),
                                to_go=left)
                lines.tell(f"{done} of {total} runs{_failed(failed)}; {left} to go")
                if row["status"] == FAILED and cause_of(row["error"]) not in errors:
                    errors.add(cause_of(row["error"]))
                    progress.console.print(f"{row['run_id']} failed: {row['error']}")

            try:
                sweep.run(workers, heard)
            except KeyboardInterrupt:
                done, _, total = sweep.progress
                raise KeyboardInterrupt(f"{done} of {total} runs in {sweep.out}; the same command "
                                        "goes on from there") from None
        done, failed, total = sweep.progress
        self._console.print(f"{done} of {total} runs{_failed(failed)}; table: "
                            f"{sweep.out / TABLE}")
        for remark in sweep.remarks:
            self._console.print(remark)
        if failed:
            self._told_failures(sweep)
        return failed

    def _told_failures(self, sweep: Sweep) -> None:
        """Each cause once, the most frequent first."""
        causes: dict[str, list[str]] = {}
        for row in sweep.rows.values():
            if row["status"] == FAILED and row["run_id"] in sweep.agenda:
                causes.setdefault(cause_of(row["error"]), []).append(row["run_id"])
        for cause, ids in sorted(causes.items(), key=lambda item: -len(item[1]))[:_MOST_CAUSES]:
            count = f"{len(ids)} runs" if len(ids) > 1 else "1 run"
            self._console.print(f"{count} failed ({ids[0]}{', ...' if len(ids) > 1 else ''}): "
                                f"{cause}")
        if len(causes) > _MOST_CAUSES:
            self._console.print(f"and {len(causes) - _MOST_CAUSES} more causes")
        self._console.print("--retry-failed runs them again")

    def _told_damage(self, wrong: dict[str, str]) -> None:
        for text in [*wrong.values()][:_MOST_DAMAGED]:
            self._console.print(text)
        count = len(wrong)
        self._console.print(f"{count} run{'s are' if count > 1 else ' is'} damaged; what is missing"
                            " is made again")

    @contextmanager
    def _clustered(self, settings: Settings, progress: Progress, bar: TaskID,
                   wall_ns: int | None) -> Iterator[Workers]:
        """Dask is imported only here: few have it, and it takes its time."""
        from desim.campaign.running.cluster import Cluster
        from desim.campaign.running.schedulers import connected

        def up(count: int) -> None:
            text = f"{count} worker{'s' * (count != 1)} up"
            progress.update(bar, description=f"runs, {text}")
            if not self._console.is_terminal:
                self._console.print(text)

        with connected(settings, _cores()) as client:
            yield Cluster(client, up, wall_ns)

    def _progress(self) -> Progress:
        return Progress(TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(),
                        TextColumn("{task.fields[failed]}"), TimeElapsedColumn(),
                        TextColumn("to go {task.fields[to_go]}"), console=self._console,
                        transient=True, disable=not self._console.is_terminal)


class _Lines:
    """A line now and then, for logs."""

    def __init__(self, console: Terminal) -> None:
        self._console, self._next_s = console, time.monotonic() + LINE_EVERY_S

    def tell(self, text: str) -> None:
        if not self._console.is_terminal and time.monotonic() >= self._next_s:
            self._console.print(text)
            self._next_s = time.monotonic() + LINE_EVERY_S


class _ToGo:
    """The time until a campaign's end: what its runs will cost, by what they have cost, at the pace
    that it has had since its first run was done."""

    def __init__(self, sweep: Sweep) -> None:
        self._sweep = sweep
        self._begin_s: float | None = None
        self._spent_s, self._end_s, self._next_s = 0.0, 0.0, 0.0

    def after(self, row: Row) -> str:
        """In words, when a run has come to its end; looked at again every few seconds."""
        now_s = time.monotonic()
        if self._begin_s is None:
            self._begin_s = now_s
            return "?"
        self._spent_s += row.get("cost", {}).get("cpu_s", 0.0)
        if self._spent_s and now_s >= self._next_s:
            self._next_s = now_s + _AGAIN_S
            agenda = self._sweep.agenda
            left_s = forecast(self._sweep.plan, agenda, finished_costs(agenda)).expected_s
            self._end_s = now_s + left_s * (now_s - self._begin_s) / self._spent_s
        return _duration(max(self._end_s - now_s, 0.0)) if self._next_s else "?"


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 90 * 60 else f"{seconds / 3600:.1f} h"


def _failed(count: int) -> str:
    return f", {count} failed" if count else ""


def _cores() -> int:
    return len(os.sched_getaffinity(0))

