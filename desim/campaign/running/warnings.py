"""Warnings about a campaign's metrics, printed at the end of a sweep."""

from __future__ import annotations

from desim.campaign.design.design import Until
from desim.campaign.design.metrics import Metrics
from desim.campaign.design.plan import Plan
from desim.campaign.folder.table import raised
from desim.campaign.running.agenda import Agenda
from desim.results.status import RunStatus


def warnings_of(plan: Plan, metrics: Metrics, agenda: Agenda) -> list[str]:
    """The warnings, a line each; none where all is well, or where no run has finished."""
    ids = dict.fromkeys(run_id for _, _, run_id in sorted(
        agenda.runs, key=lambda run: (run[0].number, run[1])) if run_id in agenda.rows)
    rows = [row for row in map(agenda.rows.__getitem__, ids) if row["status"] == RunStatus.FINISHED]
    if not rows:
        return []
    found = raised(metrics, rows)
    lines = [raised_warning(name, *one, len(rows)) for name, one in found.items()]
    design, wide, rule = plan.design, agenda.wide, plan.design.iterations
    # The design's own metrics, and those that it shows or waits for, but for patterns.
    asked = dict.fromkeys((*design.metrics, *design.report.metrics,
                           *([rule.metric] if isinstance(rule, Until) else [])))
    empty = [name for name in asked if "*" not in name and name not in found
             and all(metrics.of(row).get(name) is None for row in rows)]
    if empty:
        lines.append(f"no run has a value of {', '.join(empty)}")
    if wide and isinstance(rule, Until):
        lines.append(f"the 95 % interval of {rule.metric} is still wider than {rule.width} in "
                     f"{len(wide)} of {len(plan.vectors)} vectors after {rule.at_most} runs each")
    return lines


def raised_warning(name: str, runs: int, error: str, finished: int) -> str:
    """The warning about a metric that raised."""
    return f"metric {name} raised in {runs} of {finished} runs: {error}"
