"""Figures of several panels that share their axes: panels, axes, legend."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from desim.report.campaign.figures.style import WIDTH_IN, colour, marker
from desim.report.campaign.numbers import Axis, Panel
from desim.report.log_axis import plain

_LABELLED = 14  # up to so many levels each has its name at the axis


def paneled(count: int) -> tuple[Figure, list[Axes]]:
    """A figure of ``count`` panels in up to two columns, with one vertical axis."""
    columns = min(count, 2)
    rows = -(-count // columns)
    figure = Figure(figsize=(WIDTH_IN, 4.1 if count == 1 else 2.9 * rows + 0.5),
                    layout="constrained")
    axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for spare in axes[count:]:
        spare.remove()
    for above in axes[max(count - columns, 0):count]:  # what has none below
        above.xaxis.set_tick_params(labelbottom=True)
    return figure, list(axes[:count])


def finish(figure: Figure, all_axes: list[Axes], panels: list[Panel], title: str,
           more: list[Line2D]) -> None:
    """Add the name of the metric, and one legend for all panels."""
    for axes in all_axes:
        if not axes.xaxis.get_tick_params()["labelbottom"]:  # another panel below has it
            axes.set_xlabel("")
    for axes in all_axes[::2]:
        axes.set_ylabel(title)
    styles = {line.label: line.style for panel in panels for line in panel.lines if line.label}
    keys = [Line2D([], [], color=colour(style), marker=marker(style), markersize=5, label=label)
            for label, style in styles.items()] + more
    if keys:
        figure.legend(handles=keys, loc="outside upper left", ncols=min(len(keys), 3),
                      columnspacing=1.4, handlelength=1.8)


def span(values: np.ndarray, log: bool) -> tuple[float, float]:
    """The most that an axis shows. Intervals of very few runs may be many times as wide as the
    range of all values."""
    if not len(values):
        return -np.inf, np.inf
    if log:
        return values.min() / 4.0, values.max() * 4.0
    apart = np.ptp(values) or abs(values[0]) or 1.0
    return values.min() - 0.4 * apart, values.max() + 0.4 * apart


def limit(axes: Axes, farthest: tuple[float, float]) -> None:
    """Cut the vertical axis, in all panels that share it, to the range ``farthest``."""
    low, high = axes.get_ylim()
    axes.set_ylim(max(low, farthest[0]), min(high, farthest[1]))


def along(axes: Axes, axis: Axis | None) -> None:
    """Label the horizontal axis with a parameter."""
    if axis is None:
        axes.set_xticks([])
        return
    axes.set_xlabel(axis.name if len(axis.labels) <= _LABELLED else axis.title)
    if axis.log:
        axes.set_xscale("log")
        plain(axes.xaxis)
    if len(axis.labels) <= _LABELLED:  # all of them at the axis
        axes.set_xticks(axis.numbers if axis.is_numeric else range(len(axis.labels)),
                        axis.labels)
        if axis.log:
            axes.xaxis.set_minor_locator(NullLocator())
        if sum(map(len, axis.labels)) > 45:
            for label in axes.get_xticklabels():
                label.set(rotation=35, ha="right", rotation_mode="anchor")
