"""Sensitivity in a sampled design: a metric over each parameter, and Sobol's indices."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from desim.campaign.design.design import Saltelli
from desim.report.campaign import formatting
from desim.report.campaign.figures import layout
from desim.report.campaign.figures.style import INK, WIDTH_IN, colour
from desim.report.campaign.numbers import Estimates, Study
from desim.report.campaign.tables.table import ReportTable
from desim.statistics.intervals import t_interval
from desim.statistics.sensitivity import SobolIndices, indices

_MOST_DOTS = 600  # of vectors in a panel; more hide each other
_BINS = 8  # equal parts of the vectors, each with its mean
_FEWEST_IN_BINS = 24  # vectors: three a part, since Student's t of two is 12.7 deviations wide
_BAR, _STEP = 0.32, 0.36  # heights; two bars fill most of a parameter's row


def scatter_figure(study: Study, estimates: Estimates, metric: str) -> Figure:
    """A panel a parameter: each vector as a dot, and the mean in eight parts of its range."""
    axes_of = list(study.axes.values())
    figure = Figure(figsize=(WIDTH_IN, 2.7 * -(-len(axes_of) // 2) + 0.4), layout="constrained")
    all_axes = figure.subplots(-(-len(axes_of) // 2), min(2, len(axes_of)), sharey=True,
                               squeeze=False).ravel()
    means = estimates.means(metric).mean
    found = [vector for vector, mean in zip(study.vectors, means, strict=True) if mean == mean]
    means = means[~np.isnan(means)]
    every = max(1, len(found) // _MOST_DOTS)
    for i, (axes, axis) in enumerate(zip(all_axes, axes_of, strict=False)):
        x = axis.places(found)
        axes.scatter(x[::every], means[::every], 9, color=colour(i), alpha=0.45, linewidths=0)
        if len(x) >= _FEWEST_IN_BINS and axis.is_numeric:
            _binned(axes, x, means)
        layout.along(axes, axis)
    for spare in all_axes[len(axes_of):]:
        spare.remove()
    layout.finish(figure, list(all_axes[:len(axes_of)]), [], formatting.titled(metric),
                   [Line2D([], [], color=INK, marker="_", label="mean of eight equal parts, with "
                                                               "95 % interval")])
    return figure


def _binned(axes: Axes, x: np.ndarray, y: np.ndarray) -> None:
    parts = np.array_split(np.argsort(x, kind="stable"), _BINS)
    centres = [float(x[part].mean()) for part in parts]
    found = [t_interval(y[part])[:3] for part in parts]
    means, low, high = np.array(found, float).T
    axes.plot(centres, means, color=INK, linewidth=1.2)
    for centre, *bounds in zip(centres, low, high, strict=True):
        axes.plot([centre] * 2, bounds, color=INK, linewidth=1.2, marker="_", markersize=4)


def sobol(study: Study, estimates: Estimates, metric: str) -> list[SobolIndices] | None:
    """The indices of each parameter, from the mean of each vector; None unless the design is
    ``saltelli`` and each of its vectors has the metric."""
    if not isinstance(study.design.vectors, Saltelli):
        return None
    dimensions = len(study.axes)
    means = estimates.means(metric).mean
    if np.isnan(means).any() or len(means) != study.design.vectors.saltelli * (dimensions + 2):
        return None
    return indices(means, dimensions)


def sentences(study: Study, estimates: Estimates, metric: str) -> list[str]:
    """A sentence with the parameters by their total index; nothing without indices."""
    found = sobol(study, estimates, metric)
    if found is None or found[0].total is None:
        return []
    shares = [f"{name} {formatting.number(one.total, 2)} "
              f"{formatting.between(one.total_low, one.total_high)}" for name, one in sorted(
                  zip(study.axes, found, strict=True), key=lambda one: -(one[1].total or 0.0))]
    return [f"Share of the variance of {formatting.titled(metric)} in which each parameter has a "
            f"part (total Sobol index): {formatting.listed(shares)}."]


def sobol_figure(study: Study, found: list[SobolIndices], metric: str) -> Figure:
    """First-order and total indices as bars with their intervals."""
    figure = Figure(figsize=(WIDTH_IN, 0.62 * len(found) + 1.3), layout="constrained")
    axes = figure.subplots()
    for k, label in enumerate(("first order", "total")):
        for i, one in enumerate(found):
            value, low, high = np.array(one[3 * k:3 * k + 3], float)
            at = i + (k - 0.5) * _STEP
            axes.barh(at, value, _BAR, color=colour(k), alpha=0.75, label=None if i else label)
            axes.plot([low, high], [at, at], color=INK, linewidth=1.2, marker="|", markersize=5)
    axes.set_yticks(range(len(found)), list(study.axes))
    axes.invert_yaxis()
    axes.set_xlabel(f"share of the variance of {formatting.titled(metric)}")
    axes.axvline(0.0, color=INK, linewidth=0.7)
    axes.grid(axis="y", visible=False)
    figure.legend(loc="outside upper left", ncols=2)
    return figure


def sobol_table(study: Study, found: list[SobolIndices], metric: str) -> ReportTable:
    """The indices and their intervals as a table."""
    rows = [[name, one.first, formatting.between(one.first_low, one.first_high), one.total,
             formatting.between(one.total_low, one.total_high)]
            for name, one in zip(study.axes, found, strict=True)]
    return ReportTable(
        f"{metric}_sobol", f"Sobol indices of {formatting.titled(metric)}: what a parameter "
        "explains by itself, and what it has a part in, with 95 % intervals.",
        ["parameter", "first order", "95 % interval", "total", "95 % interval"], rows,
        ["parameter", *SobolIndices._fields],
        [[name, *one] for name, one in zip(study.axes, found, strict=True)])
