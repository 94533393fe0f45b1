"""A campaign on the terminal: what is planned, what is done, what failed, and the time to go."""

from __future__ import annotations

import time

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
)

from desim.blame import cause_of
from desim.campaign.running.agenda import Agenda
from desim.campaign.running.driver import TimeLeft
from desim.campaign.running.prediction import Cost, Forecast
from desim.campaign.running.sweep import INDEX, TABLE, Sweep
from desim.campaign.running.warnings import warnings_of
from desim.commands.views.terminal import Terminal
from desim.results.row import Row
from desim.results.status import RunStatus

LINE_EVERY_S = 10.0  # where there is no terminal
_MOST_DAMAGED = 10  # runs that are named
_MOST_CAUSES = 10


def console(quiet: bool) -> Terminal:
    """The terminal of a campaign, on which labels are text."""
    return Terminal(quiet=quiet, highlight=False, soft_wrap=True, markup=False, emoji=False)


def show_runs(on: Terminal, agenda: Agenda) -> None:
    """List every run with its state."""
    for vector, iteration, run_id in agenda.runs:
        levels = ", ".join(f"{name}={level.label}" for name, level in vector.levels.items())
        state = agenda.rows[run_id]["status"] if run_id in agenda.rows else "to run"
        on.print(f"{run_id}  {state:8}  {levels}, iteration {iteration}")
    done, failed, total = agenda.progress
    on.print(f"{total} runs, {done} done, {failed} of them failed")


def show_prediction(on: Terminal, expected: Forecast | None, costs: list[Cost], by_probes: bool,
                    jobs: int) -> None:
    """Print the ``expected`` cost of the remaining runs, and that it comes from ``costs``."""
    if expected is None:
        on.print("no prediction: every probe has failed")
        return
    expected_s, longest_s = expected
    count, ended = len(costs), sum(cost.ended for cost in costs)
    source = f"from {count} finished runs" if not by_probes else (
        f"from {count} probe{'s' * (count > 1)} of {sum(cost.cpu_s for cost in costs):.1f} s, "
        f"{ended} of them to the end")
    most = f"at most {_duration(longest_s / jobs)}, every run to its time limit"
    if all(cost.lasts_s is None for cost in costs):
        on.print(f"{_duration(longest_s)} of CPU at most ({source}, and none far enough to tell "
                 f"how long runs last); with {jobs} jobs on cores of their own {most}")
        return
    guessed = "" if ended else ", if exploring goes on as it began in these"
    on.print(f"{_duration(expected_s)} of CPU are to be expected ({source}){guessed}; "
             f"{_duration(expected_s / jobs)} with {jobs} jobs on cores of their own, {most}")


def slow_line(run_id: str, seconds: float) -> str:
    """A line about a run that takes long."""
    return (f"{run_id} has been at it for {seconds:.0f} s; limits: {{wall: ...}} of the design "
            "would end it")


class SweepView:
    """Shows a campaign while it runs. Use it as a context; it prints the outcome at the end."""

    def __init__(self, on: Terminal, sweep: Sweep, where: str) -> None:
        self._console, self._sweep = on, sweep
        self._time_left = TimeLeft(sweep)
        self._errors: set[str] = set()  # each is printed once, the others are counted
        self._next_line_s = time.monotonic() + LINE_EVERY_S
        self._print_findings()
        done, failed, total = sweep.agenda.progress
        on.print(f"{total} runs, {done} done already; {where}, in {sweep.out}")
        self._progress = _progress(on)
        self._bar = self._progress.add_task("runs", total=total, completed=done,
                                            failed=_failed(failed), to_go="")

    def __enter__(self) -> SweepView:
        self._progress.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._progress.stop()
        if kind is None:
            self._print_outcome()

    def run_ended(self, row: Row) -> None:
        """Show the new state of the campaign, and an error that is new."""
        done, failed, total = self._sweep.agenda.progress
        left_s = self._time_left.after(row)
        left = "?" if left_s is None else _duration(left_s)
        self._progress.update(self._bar, completed=done, total=total, failed=_failed(failed),
                              to_go=left)
        if not self._console.is_terminal and time.monotonic() >= self._next_line_s:
            self._console.print(f"{done} of {total} runs{_failed(failed)}; {left} to go")
            self._next_line_s = time.monotonic() + LINE_EVERY_S
        if row["status"] == RunStatus.FAILED and cause_of(row["error"]) not in self._errors:
            self._errors.add(cause_of(row["error"]))
            self._progress.console.print(f"{row['run_id']} failed: {row['error']}")

    def slow(self, run_id: str, seconds: float) -> None:
        """Show that a run takes long."""
        self._progress.console.print(slow_line(run_id, seconds))

    def workers_up(self, count: int) -> None:
        """Show the number of a cluster's workers."""
        text = f"{count} worker{'s' * (count != 1)} up"
        self._progress.update(self._bar, description=f"runs, {text}")
        if not self._console.is_terminal:
            self._console.print(text)

    def _print_findings(self) -> None:
        """Print what was wrong with the campaign's folder."""
        out, sweep, show = self._sweep.out, self._sweep, self._console.print
        if sweep.index.damaged:
            show(f"{out / INDEX}: {sweep.index.damaged} lines could not be read; it was made again "
                 "from the folders of the runs")
        if sweep.index.cut_off:
            show(f"{out / INDEX}: its last line was cut off, and was taken away")
        if sweep.index_was_lost:
            show(f"{out / INDEX}: was not there; it was made again from the folders of the runs")
        wrong = [*sweep.damaged_runs.values()]
        for text in wrong[:_MOST_DAMAGED]:
            show(text)
        if wrong:
            show(f"{len(wrong)} run{'s are' if len(wrong) > 1 else ' is'} damaged; what is missing "
                 "is made again")
        if sweep.others:
            show(f"{out}: {sweep.others} runs of an earlier design, another scenario or another "
                 "version of desim; they stay, but are not in the table")

    def _print_outcome(self) -> None:
        sweep = self._sweep
        done, failed, total = sweep.agenda.progress
        self._console.print(f"{done} of {total} runs{_failed(failed)}; table: "
                            f"{sweep.out / TABLE}")
        for warning in warnings_of(sweep.plan, sweep.metrics, sweep.agenda):
            self._console.print(warning)
        if failed:
            self._print_failures()

    def _print_failures(self) -> None:
        """Print each cause once, the most frequent first."""
        causes: dict[str, list[str]] = {}
        for row in self._sweep.agenda.rows.values():
            if row["status"] == RunStatus.FAILED and row["run_id"] in self._sweep.agenda:
                causes.setdefault(cause_of(row["error"]), []).append(row["run_id"])
        for cause, ids in sorted(causes.items(), key=lambda item: -len(item[1]))[:_MOST_CAUSES]:
            count = f"{len(ids)} runs" if len(ids) > 1 else "1 run"
            self._console.print(f"{count} failed ({ids[0]}{', ...' if len(ids) > 1 else ''}): "
                                f"{cause}")
        if len(causes) > _MOST_CAUSES:
            self._console.print(f"and {len(causes) - _MOST_CAUSES} more causes")
        self._console.print("--retry-failed runs them again")


def _progress(on: Terminal) -> Progress:
    return Progress(TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(),
                    TextColumn("{task.fields[failed]}"), TimeElapsedColumn(),
                    TextColumn("to go {task.fields[to_go]}"), console=on,
                    transient=True, disable=not on.is_terminal)


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 90 * 60 else f"{seconds / 3600:.1f} h"


def _failed(count: int) -> str:
    return f", {count} failed" if count else ""
