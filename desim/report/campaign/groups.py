"""Metrics that belong together in one figure: which of them gives in first?

``report.metrics`` names them by a pattern, ``"*_delivered"``: of the design's own metrics all that
match, of the others where none of its own does.
"""

from __future__ import annotations

from fnmatch import fnmatchcase
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from desim.report.campaign import figures, wording
from desim.report.campaign.estimates import Estimates
from desim.report.campaign.knees import ONSET, Bend, bend, onset
from desim.report.campaign.lines import Line, Panel
from desim.report.campaign.study import Study
from desim.report.campaign.style import colour, marker
from desim.report.campaign.tables import Cell, Table


class Group(NamedTuple):
    """``metrics`` of one ``pattern``."""

    pattern: str
    metrics: tuple[str, ...]

    @property
    def name(self) -> str:
        """For files and anchors."""
        return "group_" + "".join(letter for letter in self.pattern if letter not in "*?[]")

    @property
    def common(self) -> str:
        """What the names share, as a title."""
        return wording.titled(self.pattern.replace("*", " ").strip(" _"))

    def of(self, metric: str) -> str:
        """What tells a metric from the others."""
        before, _, after = self.pattern.partition("*")
        return metric.removeprefix(before).removesuffix(after).replace("_", " ") or metric


def presented(study: Study) -> tuple[list[str], list[Group]]:
    """The metrics that have a figure each, and the groups. What no run has is left out."""
    own = [name for name in study.design.metrics if name in study.metrics]
    single, groups = [], []
    for asked in study.design.report.metrics:
        if asked in study.metrics:
            single.append(asked)
        elif "*" in asked:
            found = [name for names in (own, study.metrics) for name in names
                     if fnmatchcase(name, asked)]
            mine = [name for name in found if name in own] or found
            if mine:
                groups.append(Group(asked, tuple(dict.fromkeys(mine))))
    return single, groups


def group_figure(study: Study, estimates: Estimates, group: Group, panels: list[Panel]) -> Figure:
    """A panel for each line of the metrics' own figures, in it a line for each metric."""
    drawn = [Panel(", ".join(filter(None, [panel.title, line.label])), [line])
             for panel in panels for line in panel.lines][:12]
    figure, all_axes = figures.paneled(len(drawn))
    axis = study.against
    for axes, panel in zip(all_axes, drawn, strict=True):
        line = panel.lines[0]
        at = np.array([vector.levels[axis.name] for vector in line.vectors])
        x = at if axis.numbers is None else axis.numbers[at]
        for i, metric in enumerate(group.metrics):
            found = [estimates.of(metric, vector) for vector in line.vectors]
            mean, low, high = np.array([[one.mean, one.low, one.high] for one in found], float).T
            axes.plot(x, mean, color=colour(i), marker=marker(i), markersize=4.5, linewidth=1.4,
                      linestyle="-" if axis.numbers is not None else "none")
            axes.fill_between(x, low, high, color=colour(i), alpha=0.18, linewidth=0)
        axes.set_title(panel.title)
        figures.along(axes, axis)
    keys = [Line2D([], [], color=colour(i), marker=marker(i), markersize=5, label=group.of(metric))
            for i, metric in enumerate(group.metrics)]
    figures.finish(figure, all_axes, [], group.common, keys)
    return figure


def order_of_onset(study: Study, estimates: Estimates, group: Group, panels: list[Panel],
                   ) -> tuple[Table, list[str]]:
    """Who falls under 95 % of its best first, as a table and in words, line by line."""
    axis, rows, sentences = study.against, [], []
    for panel in panels:
        for line in panel.lines:
            place = ", ".join(filter(None, [panel.title, line.label]))
            found = [(metric, onset(estimates, metric, line),
                      bend(study, estimates, metric, line) if axis.numbers is not None else None)
                     for metric in group.metrics]
            rows += [[place or "all", group.of(metric), *_onset_cells(study, line, at, knee)]
                     for metric, at, knee in found]
            sentences.append(_first(study, estimates, group, line, place,
                                    {metric: at for metric, at, _ in found}))
    head = ["line", "metric", f"under {ONSET:.0%} of its best from", "knee", "interval"]
    table = Table(group.name, f"{group.common}: where each gives in, coming from the end where it "
                  "is best.", head, rows, head, rows)
    return table, sentences


def _onset_cells(study: Study, line: Line, at: int | None, knee: Bend | None) -> list[Cell]:
    axis = study.against
    label = "nowhere" if at is None else axis.labels[line.vectors[at].levels[axis.name]]
    if knee is None or knee.knee is None:
        return [label, "none", ""]
    at, low, high = (wording.quantity(value, axis.unit) for value in knee.knee[:3])
    return [label, at, f"{low} to {high}"]


def _first(study: Study, estimates: Estimates, group: Group, line: Line, place: str,
           begins: dict[str, int | None]) -> str:
    falling = {metric: at for metric, at in begins.items() if at is not None}
    prefix = f"{place}: " if place else ""
    if not falling:
        return f"{prefix}none of {wording.listed([group.of(m) for m in begins])} gives in."
    # From which end the line is walked, its best says.
    means = [estimates.of(next(iter(falling)), vector).mean for vector in line.vectors]
    known = [mean for mean in means if mean is not None]
    sign = -1 if known[-1] > known[0] else 1
    order = sorted(falling, key=lambda metric: sign * falling[metric])
    first = [metric for metric in order if falling[metric] == falling[order[0]]]
    axis = study.against

    def told(metric: str) -> str:
        vector = line.vectors[falling[metric]]
        return (f"{group.of(metric)} (at {axis.labels[vector.levels[axis.name]]}, mean "
                f"{wording.number(estimates.of(metric, vector).mean, 3)})")

    rest = [told(metric) for metric in order if metric not in first]
    return (f"{prefix}{wording.listed([told(metric) for metric in first])} "
            f"{'gives' if len(first) == 1 else 'give'} in first"
            f"{', then ' + wording.listed(rest) if rest else ''}.")
