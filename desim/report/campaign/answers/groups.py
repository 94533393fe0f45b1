"""Groups of metrics in one figure: which of them falls first?

``report.metrics`` names them by a pattern, ``"*_delivered"``: of the design's own metrics all that
match, of the others where none of its own does.
"""

from __future__ import annotations

from fnmatch import fnmatchcase
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from desim.report.campaign import formatting
from desim.report.campaign.figures import layout
from desim.report.campaign.figures.style import colour, marker
from desim.report.campaign.numbers import TIMES, Estimates, Panel, PlotLine, Study, VectorRuns
from desim.report.campaign.numbers.knees import ONSET, Knees, interval, onset
from desim.report.campaign.tables.table import Cell, ReportTable


class MetricGroup(NamedTuple):
    """The ``metrics`` that match one ``pattern``."""

    pattern: str
    metrics: tuple[str, ...]

    @property
    def name(self) -> str:
        """The group's name in files and anchors."""
        return "group_" + "".join(letter for letter in self.pattern if letter not in "*?[]")

    @property
    def common(self) -> str:
        """The part that the names share, as a title."""
        return formatting.titled(self.pattern.replace("*", " ").strip(" _"))

    def of(self, metric: str) -> str:
        """The part of a metric's name that the others do not share."""
        before, _, after = self.pattern.partition("*")
        return metric.removeprefix(before).removesuffix(after).replace("_", " ") or metric


def presented(study: Study) -> tuple[list[str], list[MetricGroup]]:
    """The metrics with a figure each, and the groups. A metric that no run has is left out, except
    for the exploration time: if no run reached the aim, that is a result."""
    single, groups = [], []
    for asked in study.design.report.metrics:
        if study.has(asked) or asked == TIMES[0] and asked in study.metrics:
            single.append(asked)
        elif "*" in asked:
            found = tuple(name for name in study.metrics if fnmatchcase(name, asked))
            own = tuple(name for name in study.design.metrics if name in found)
            if found:
                groups.append(MetricGroup(asked, own or found))
    return single, groups


def group_figure(study: Study, estimates: Estimates, group: MetricGroup, panels: list[Panel],
                 ) -> Figure:
    """A figure with a panel for each line of the metrics' own figures, and in it a line for each
    metric."""
    drawn = [Panel(panel.place(line), [line]) for panel in panels for line in panel.lines][:12]
    figure, all_axes = layout.paneled(len(drawn))
    axis = study.axis
    for axes, panel in zip(all_axes, drawn, strict=True):
        vectors = panel.lines[0].vectors
        x = axis.places(vectors)
        for i, metric in enumerate(group.metrics):
            mean, *bounds = np.array([[one.mean, one.low, one.high] for one in (
                estimates.of(metric, vector) for vector in vectors)], float).T
            axes.plot(x, mean, color=colour(i), marker=marker(i), markersize=4.5, linewidth=1.4,
                      linestyle="-" if axis.is_numeric else "none")
            axes.fill_between(x, *bounds, color=colour(i), alpha=0.18, linewidth=0)
        axes.set_title(panel.title)
        layout.along(axes, axis)
    layout.limit(all_axes[0], layout.span(np.concatenate([
        estimates.of(metric, vector).values for metric in group.metrics
        for panel in drawn for vector in panel.lines[0].vectors]), False))
    layout.finish(figure, all_axes, [], group.common, [
        Line2D([], [], color=colour(i), marker=marker(i), markersize=5, label=group.of(metric))
        for i, metric in enumerate(group.metrics)])
    return figure


def order_of_onset(study: Study, estimates: Estimates, knees: Knees, group: MetricGroup,
                   panels: list[Panel]) -> tuple[ReportTable, list[str]]:
    """The order in which the metrics fall under 95 % of their best, as a table and in words, line
    by line."""
    found = [_Onsets(study, estimates, knees, group, line, panel.place(line))
             for panel in panels for line in panel.lines]
    rows = [one.row(metric) for one in found for metric in one.onsets]
    head = ["line", "metric", "best mean", "at", f"under {100 * ONSET:.0f} % of it from", "knee",
            "95 % interval"]
    return ReportTable(group.name, f"{group.common}: where each falls, on the way from its "
                       "best to the worse end.", head, rows, head, rows), [
        sentence for one in found for sentence in one.sentence()]


class _Onsets:
    """The ``onsets`` of one line by metric, of the metrics that its runs have."""

    def __init__(self, study: Study, estimates: Estimates, knees: Knees, group: MetricGroup,
                 line: PlotLine, place: str) -> None:
        self._axis, self._estimates, self._knees, self._group = study.axis, estimates, knees, group
        self._line, self._place = line, place
        self.onsets = {metric: one for metric in group.metrics
                       if (one := onset(estimates, metric, line))}

    def row(self, metric: str) -> list[Cell]:
        one, axis, vectors = self.onsets[metric], self._axis, self._line.vectors
        row: list[Cell] = [
            self._place or "all", self._group.of(metric),
            self._estimates.of(metric, vectors[one.best]).mean, axis.label(vectors[one.best]),
            "nowhere" if one.at is None else axis.label(vectors[one.at])]
        found = self._knees.of(metric, self._line, self._place) if axis.is_numeric else None
        if found is None or not found.knees:
            return [*row, "none" if found and found.was_sought else "–", ""]
        return [*row, formatting.listed([formatting.quantity(knee.at, axis.unit)
                                         for knee in found.knees]),
                formatting.listed([interval(knee, axis) for knee in found.knees])]

    def sentence(self) -> list[str]:
        """The order in words; empty if there is nothing to compare."""
        if len(self.onsets) < 2:
            return []
        prefix = f"{self._place}: " if self._place else ""
        falling = {metric: one.at for metric, one in self.onsets.items() if one.at is not None}
        if not falling:
            names = [self._group.of(metric) for metric in self.onsets]
            return [f"{prefix}none of {formatting.listed(names)} falls."]
        order = sorted(falling, key=lambda metric: self.onsets[metric].sign * falling[metric])
        first, rest = ([self._falls(metric, self._line.vectors[falling[metric]])
                        for metric in order if (falling[metric] == falling[order[0]]) is is_first]
                       for is_first in (True, False))
        return [f"{prefix}{formatting.listed(first)} "
                f"{'falls' if len(first) == 1 else 'fall'} first"
                f"{', then ' + formatting.listed(rest) if rest else ''}."]

    def _falls(self, metric: str, vector: VectorRuns) -> str:
        return f"{self._group.of(metric)} (at {self._axis.label(vector)})"
