"""The figure of a metric, and its caption: a line per setting over the parameter, a dot per run."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from desim.report.campaign import formatting
from desim.report.campaign.figures import layout
from desim.report.campaign.figures.style import INK, colour, marker
from desim.report.campaign.numbers import (
    TIMES,
    Axis,
    Estimate,
    Estimates,
    Panel,
    PlotLine,
    Study,
    VectorRuns,
)
from desim.report.campaign.numbers.knees import LineKnees
from desim.report.log_axis import plain

_MOST_DOTS = 800  # in a figure
_SMALL, _LARGE = 10.0, 62.0  # area of symbols [pt^2], for no success and for the most
_ASIDE = 0.012  # share of the axis from the first line's symbol at a value to the last line's
_BANDS = 3  # lines whose knees are drawn over the whole height
_WIDE_RANGE = 50.0  # largest over smallest value of a metric with a logarithmic scale


def metric_figure(study: Study, estimates: Estimates, metric: str, panels: list[Panel],
                  bends: list[LineKnees]) -> Figure:
    """The figure of a metric."""
    figure, all_axes = layout.paneled(len(panels))
    painter = _Painter(study, estimates, metric, panels)
    for axes, panel in zip(all_axes, panels, strict=True):
        for place, line in enumerate(panel.lines):
            painter.line(axes, line, (place + 0.5) / len(panel.lines) - 0.5)
        _mark_knees(axes, [bend for bend in bends if bend.knees
                           and any(bend.line is line for line in panel.lines)])
        painter.axis(axes, panel.title)
    layout.limit(all_axes[0], painter.span)
    layout.finish(figure, all_axes, panels, formatting.titled(metric), painter.keys(
        any(bend.knees for bend in bends)))
    return figure


def _mark_knees(axes: Axes, bends: list[LineKnees]) -> None:
    """Draw knees as bands from top to bottom; as strips where bands would hide each other."""
    strips = len(bends) > _BANDS
    for place, bend in enumerate(bends):
        bottom, top = (0.03 * place, 0.03 * (place + 1)) if strips else (0.0, 1.0)
        for knee in bend.knees:
            axes.axvspan(knee.low, knee.high, bottom, top, color=colour(bend.line.style),
                         alpha=0.35 if strips else 0.13, linewidth=0)
            axes.axvline(knee.at, bottom, top, color=colour(bend.line.style),
                         linewidth=2.0 if strips else 1.0,
                         linestyle="-" if strips else (0, (5, 2)))


class _Painter:
    """Draws the lines of one metric, with one scale of symbols for all."""

    def __init__(self, study: Study, estimates: Estimates, metric: str, panels: list[Panel],
                 ) -> None:
        self._study, self._estimates, self._metric = study, estimates, metric
        self._axis: Axis | None = study.against
        found = [estimates.of(metric, vector) for panel in panels for line in panel.lines
                 for vector in line.vectors]
        self._successes = {one.reached for one in found}
        self._most = max(self._successes, default=0)
        self._every = max(1, sum(one.n for one in found) // _MOST_DOTS)
        self._limit = estimates.limit(metric) if any(one.late for one in found) else None
        values = np.concatenate([one.values for one in found] or [np.zeros(0)])
        # Shares are read on a linear scale.
        self._log = bool(len(values) and values.min() > 0 and values.max() > 1
                         and values.max() / values.min() > _WIDE_RANGE)
        self.span = layout.span(values, self._log)

    def line(self, axes: Axes, line: PlotLine, place: float) -> None:
        """Draw a line. ``place``, in [-0.5, 0.5], moves it aside, so that intervals at one value do
        not overlap."""
        found = [self._estimates.of(self._metric, vector) for vector in line.vectors]
        x = self._places(line, place)
        shade = colour(line.style)
        self._dots(axes, x, found, shade)
        means, low, high = np.array([[one.mean, one.low, one.high] for one in found], float).T
        if self._axis is not None and self._axis.is_numeric:
            axes.plot(x, means, color=shade, linewidth=1.4, zorder=3)
        axes.vlines(x, low, high, color=shade, linewidth=1.3, zorder=3)
        axes.plot(np.tile(x, 2), np.concatenate([low, high]), color=shade, linestyle="none",
                  marker="_", markersize=5, zorder=3)
        faces = [shade if one.reached or len(self._successes) == 1 else "none" for one in found]
        axes.scatter(x, means, [self._area(one.reached) for one in found],
                     marker=marker(line.style), facecolors=faces, edgecolors=shade,
                     linewidths=1.1, zorder=4)
        if self._limit is not None:
            successes = [one.times and one.times.successes.mean for one in found]
            axes.plot(x, np.array(successes, float), color=shade, linewidth=0.9, linestyle=":",
                      marker="x", markersize=4, zorder=2)

    def axis(self, axes: Axes, title: str) -> None:
        """Label the axes of a panel."""
        if title:
            axes.set_title(title)
        if self._limit is not None:
            axes.axhline(self._limit, color=INK, linewidth=0.8, linestyle="--", alpha=0.6)
        if self._log:
            axes.set_yscale("log")
            plain(axes.yaxis)
        layout.along(axes, self._axis)

    def keys(self, with_knee: bool) -> list[Line2D]:
        """The entries of the legend other than the lines."""
        out = []
        if len(self._successes) > 1:
            out += [Line2D([], [], color=INK, linestyle="none", marker="o",
                           markersize=self._area(count)**0.5,
                           label=f"{formatting.counted(count, 'run')} {self._study.success}")
                    for count in sorted({max(min(self._successes), 1), self._most})]
            if 0 in self._successes:
                out.append(Line2D([], [], color=INK, linestyle="none", marker="o",
                                  markerfacecolor="none", markersize=_SMALL**0.5,
                                  label="none did"))
        if self._limit is not None:
            out += [Line2D([], [], color=INK, linestyle=":", marker="x", markersize=4,
                           label="mean of the successes alone"),
                    Line2D([], [], color=INK, linestyle="--", alpha=0.6,
                           label=f"time limit, {formatting.number(self._limit)} s")]
        if with_knee:
            out.append(Line2D([], [], color=INK, linestyle=(0, (5, 2)), linewidth=1.0,
                              label="knee, with its interval"))
        return out

    def _places(self, line: PlotLine, place: float) -> np.ndarray:
        axis = self._axis
        if axis is None:
            return np.zeros(len(line.vectors))
        x = axis.places(line.vectors)
        if not axis.is_numeric:
            return x + 0.5 * place
        aside = _ASIDE * place
        return x * (axis.numbers[-1] / axis.numbers[0]) ** aside if axis.log \
            else x + aside * np.ptp(axis.numbers)

    def _dots(self, axes: Axes, x: np.ndarray, found: list[Estimate], shade: str) -> None:
        at = np.concatenate([np.full(one.n, where) for where, one in zip(x, found, strict=True)])
        y = np.concatenate([one.values for one in found])
        late = np.zeros(len(y), bool) if self._limit is None else y >= self._limit
        shown = np.arange(len(y)) % self._every == 0
        for which, symbol in ((shown & ~late, "o"), (shown & late, "^")):
            axes.scatter(at[which], y[which], 9, marker=symbol, color=shade, alpha=0.35,
                         linewidths=0, zorder=2)

    def _area(self, successes: int) -> float:
        if len(self._successes) == 1:  # nothing to tell apart
            return (_SMALL + _LARGE) / 2
        return _SMALL + (_LARGE - _SMALL) * successes / max(self._most, 1)


def reading(study: Study) -> str:
    """The legend that the figures of all metrics share, in words."""
    text = ("Lines and large symbols are means over the runs of a vector, bars their 95 % "
            "intervals, faint dots single runs (▲: stopped at the time limit).")
    if len({int(study.reached[vector.rows].sum()) for vector in study.vectors}) > 1:
        text += f" The larger a symbol, the more runs {study.success}; hollow: none did."
    if study.others:
        text += (f" Panels are the levels of "
                 f"{formatting.listed([axis.name for axis in study.others])}.")
    return text


def caption(study: Study, estimates: Estimates, metric: str, vectors: list[VectorRuns]) -> str:
    """The caption of a metric's figure that shows ``vectors``."""
    found = [estimates.of(metric, vector) for vector in vectors]
    finished = sum(one.runs - one.failed for one in found)
    have = sum(one.n for one in found)
    text = f"{formatting.titled(metric)} against {study.against.name}. " if study.against \
        else f"{formatting.titled(metric)}. "
    if any(one.late for one in found):
        text += ("Mean restricted to the time limit: a run that was stopped counts with the "
                 "limit. Dotted: the mean of the successes, which leaves such runs out. ")
    if have < finished:
        text += f"{finished - have} of {finished} finished runs have no such value"
        text += (", or are of a vector of which some runs were stopped before it for another "
                 "reason than the time limit. ") if metric in TIMES else ". "
    return text
