"""The metrics of a campaign: the numbers of each run's summary, and those that the design adds."""

from __future__ import annotations

import fnmatch
import math
import re
from collections.abc import Callable

from desim import plugins
from desim.campaign.design.columns import refuse_twins
from desim.campaign.design.design import Until
from desim.campaign.design.plan import Plan, new_levels
from desim.campaign.design.rehearsal import Made, Rehearsal, here
from desim.errors import InputError, did_you_mean
from desim.monitor.monitor import StopReason
from desim.results.row import Row
from desim.results.status import RunStatus
from desim.scenario import expression

_MOST_REHEARSALS = 16  # where all of these fail, only other levels may tell more
# Which reasons there are shows only in a run: what did not happen happened 0 times.
_COUNTED = re.compile(r"(?:messages_dropped|packets_lost)_\w+")
_INSTANTS = ("exploration_time_s", "union_time_s", "fleet_time_s")
_FUNCTION = re.compile(r"(.*/)?[A-Za-z_][\w.]*:[A-Za-z_]\w*")


class Metrics:
    """All metrics of a plan's runs. ``names``: those that each run has, in order. ``functions``:
    those that are computed from a run's folder.

    Raises ``InputError`` for an expression that names what no run has, or a function that fails:
    one run is begun for that, and thrown away. ``made`` does that rehearsal: a worker's, where a
    plug-in must not harm this process.
    """

    def __init__(self, plan: Plan, made: Made = here) -> None:
        loaded = plan.loaded
        self._own: dict[str, Callable[[Row], float | None]] = {}
        self._paths = {name: plugins.beside(text, loaded.folder(("metrics", name)))
                       for name, text in loaded.design.metrics.items() if _FUNCTION.fullmatch(text)}
        self.functions = tuple(dict.fromkeys(self._paths.values()))
        rehearsed = _rehearsed(plan, self.functions, made)
        found = rehearsed["metrics"]
        self.names = tuple(found)
        self._numbers = [name for name, value in found.items() if not isinstance(value, str)]
        for name, text in loaded.design.metrics.items():
            try:
                self._own[name] = self._made(name, text, rehearsed["raised"])
            except InputError as error:
                raise loaded.wrong(("metrics", name), str(error)) from None
        self.names = (*self.names, *self._own)
        self._numbers += self._own
        refuse_twins(plan, self.names)
        self._refuse_unknown(plan)

    def of(self, row: Row) -> dict[str, object]:
        """All metrics of a finished run."""
        return {**row["metrics"], **{name: own(row) for name, own in self._own.items()}}

    def raised(self, row: Row) -> dict[str, str]:
        """The errors, by metric, of functions that raised on a finished run."""
        errors = row.get("raised", {})
        return {name: errors[path] for name, path in self._paths.items() if path in errors}

    def value(self, name: str, row: Row) -> float | None:
        """One metric of a run; None where it is absent. It serves to judge whether a vector is
        known well enough.

        An instant that was not reached within the time limit counts as the run's end, in the
        design's expressions too, so that vectors that fail do not pass for well known (restricted
        mean). Where the run stopped for another reason nothing is known about the instant."""
        if row["status"] != RunStatus.FINISHED:
            return None
        found = row["metrics"]
        ends = {instant: found["simulated_s"] for instant in _INSTANTS
                if found.get(instant) is None and found["stop_reason"] == StopReason.ELAPSED}
        row = {**row, "metrics": {**found, **ends}}
        return self._own[name](row) if name in self._own else row["metrics"].get(name)

    def _made(self, name: str, text: str, raised: dict[str, str],
              ) -> Callable[[Row], float | None]:
        if name in self.names:
            raise InputError("is the name of a metric of every run; choose another one")
        if path := self._paths.get(name):
            if path in raised:
                raise InputError(raised[path])
            return lambda row: row["functions"].get(path)
        counted = [found for found in _COUNTED.findall(text) if found not in self.names]
        compiled = expression.compile(text, (*self._numbers, *counted))

        def evaluate(row: Row) -> float | None:
            try:
                value = compiled.evaluate(dict.fromkeys(counted, 0) | row["metrics"])
            except TypeError:  # of a metric that this run has not
                return None
            return None if value is None else float(value)

        return evaluate

    def _refuse_unknown(self, plan: Plan) -> None:
        design = plan.design
        leads = {lead for task in plan.tasks for lead in plugins.load("task", task).leads}
        asked: list[tuple[tuple[str | int, ...], str]] = [
            (("report", "metrics", i), name) for i, name in enumerate(design.report.metrics)]
        if isinstance(design.iterations, Until):
            asked.append((("iterations", "metric"), design.iterations.metric))
        for path, name in asked:
            # What the report shows may be a pattern, "*_delivered", for metrics in one figure, and
            # what leads a task, though the run was of another one.
            known = (fnmatch.filter(self._numbers, name) or name in leads
                     if path[0] == "report" else name in self._numbers)
            if not known and not _COUNTED.fullmatch(name):
                raise plan.loaded.wrong(path, f"no run has a number {name!r}"
                                        f"{did_you_mean(name, self._numbers)}; allowed: "
                                        f"{', '.join(self._numbers)}")
        for key in ("against", "by"):
            parameter = getattr(design.report, key)
            if parameter is not None and parameter not in plan.parameters:
                raise plan.loaded.wrong(("report", key), f"there is no parameter {parameter!r}"
                                        f"{did_you_mean(parameter, plan.parameters)}; allowed: "
                                        f"{', '.join(plan.parameters) or 'none'}")


def _rehearsed(plan: Plan, functions: tuple[str, ...], made: Made) -> Row:
    """The row of a rehearsal of the first vector that can be run, of a few spread over the design
    and one of each other level. If none can, raises ``InputError`` with the errors of the first.
    """
    wrong: list[InputError] = []
    few = plan.vectors[::math.ceil(len(plan.vectors) / _MOST_REHEARSALS)]
    for vector in {vector.number: vector
                   for vector in (*few, *new_levels([*few, *plan.vectors]))}.values():
        try:
            row = made(Rehearsal(plan.run_id(vector, 0), plan.scenario(vector, 0), functions))
        except InputError as error:
            wrong.append(error)
            continue
        if row["status"] == RunStatus.FINISHED:
            return row
        wrong.append(plan.loaded.wrong(("base",), f"a run fails at once: {row['error']}"))
    raise wrong[0]
