"""The tables of a report: all metrics by vector, one metric by vector, comparisons."""

from __future__ import annotations

import numpy as np

from desim.report.campaign import formatting
from desim.report.campaign.numbers import TIMES, Axis, Estimate, Estimates, Means, Study, VectorRuns
from desim.report.campaign.numbers.contrasts import Contrast
from desim.report.campaign.tables.table import Cell, ReportTable, Shown

_MOST_VECTORS = 1000  # that are looked at one by one
_WIDE_FOR = 150  # up to so many vectors the page's tables have all metrics
_MOST_APART = 12  # metrics that differ between vectors, beside those that the design asks about
_PARTS = ("messages_by_topic_", "traffic_", "hosts_", "cluster_nodes_", "discovery_by_kind_")


def all_metrics(study: Study, estimates: Estimates) -> tuple[ReportTable, ReportTable | None]:
    """Every metric of every vector: the presented ones with their intervals, of the others the
    mean of the runs that have them. The page's first table has the presented ones and those that
    differ most between vectors, the second one, if there are any, the others."""
    presented = [name for name in study.design.report.metrics if name in study.metrics]
    others = [name for name in study.metrics if name not in presented and name != "censored"]
    means = {name: _means(study, estimates, name) for name in (*presented, *others)}
    few = len(study.vectors) <= _WIDE_FOR
    shown = {*presented, *(_most_apart({name: means[name] for name in others
                                        if not name.startswith(_PARTS)}) if few else ())}
    rest = [name for name in others if few and name not in shown]
    exact_head = exact_vector_head(study)
    columns = [column for name, found in means.items() for column in found[:len(_endings(name))]]
    exact = ([*exact_vector_cells(study, vector), *(
        None if np.isnan(column[i]) else float(column[i]) for column in columns)]
        for i, vector in enumerate(study.vectors))  # a file's rows, one at a time
    caption = ("mean ± half of the 95 % interval; times are restricted to the time limit; ≥ where "
               "runs that were not there by then count with it.")
    first = ReportTable(
        "metrics_by_vector", "The metrics that the design asks about and those that differ most "
        f"between vectors: {caption}", *_shown(study, {
            name: found for name, found in means.items() if name in shown}),
        [*exact_head, *(f"{name}{ending}" for name in means for ending in _endings(name))], exact)
    return first, ReportTable(
        "other_metrics", f"By vector: {caption}",
        *_shown(study, {name: means[name] for name in rest}), [], []) if rest else None


def _most_apart(means: dict[str, Means]) -> list[str]:
    """The metrics with vectors whose intervals are apart, those first that are farthest apart for
    the width of their intervals."""
    found = {}
    for name, (_, low, high, *_) in means.items():
        known = np.isfinite(low)
        if known.any() and low[known].max() > high[known].min():
            width = float(np.mean(high[known] - low[known]))
            found[name] = (low[known].max() - high[known].min()) / width if width else np.inf
    return sorted(found, key=lambda name: -found[name])[:_MOST_APART]


def _shown(study: Study, means: dict[str, Means]) -> tuple[list[str], list[list[Cell | Shown]]]:
    """The head and the rows of a table of these metrics."""
    return [*vector_head(study), *map(formatting.titled, means)], [[*vector_cells(study, vector), *(
        Shown(_with_half(*(column[i] for column in found)), found.mean[i])
        for found in means.values())] for i, vector in enumerate(study.vectors)]


def _endings(metric: str) -> tuple[str, ...]:
    """The endings of the names of a metric's columns, in the order of ``Means``."""
    return ("", "_low", "_high", "_n", "_late")[:5 if metric in TIMES else 4]


def one_metric(study: Study, estimates: Estimates, metric: str, drawn: list[VectorRuns],
               holds: dict[int, float]) -> ReportTable:
    """A metric by vector; of times also the median and the mean of the successes. Of very many
    vectors only those that are drawn. ``holds``, by the vector's number: the share of such
    intervals that hold the mean, where that was measured."""
    timed = metric in TIMES
    head = [*vector_head(study), "mean" if not timed else "restricted mean", "95 % interval", "n"]
    exact_head = [*exact_vector_head(study), "mean", "low", "high", "n", "method"]
    if holds:
        head.append("which holds")
        exact_head.append("coverage")
    if timed:
        head += ["median (Kaplan-Meier)", "mean of the successes"]
        exact_head += ["median", "median_low", "median_high", "successes_mean", "successes_low",
                       "successes_high", "successes_n", "limit"]
    rows: list[list[Cell | Shown]] = []
    exact: list[list[Cell]] = []
    few = len(study.vectors) <= _MOST_VECTORS
    for vector in study.vectors if few else drawn:
        one = estimates.of(metric, vector)
        row = [*vector_cells(study, vector),
               Shown(formatting.at_least(one.mean, one.late), one.mean),
               Shown(formatting.between(one.low, one.high), one.low), one.n]
        line = [*exact_vector_cells(study, vector), one.mean, one.low, one.high, one.n, one.method]
        if holds:
            share = holds.get(vector.number)
            row.append(Shown("–" if share is None else f"{share:.1%}", share))
            line.append(share)
        if timed:
            more, exact_more = _times(one)
            row, line = row + more, line + exact_more
        rows.append(row)
        exact.append(line)
    others = "" if few else (f" {len(drawn)} of {len(study.vectors)} vectors; the others stand in "
                             "metrics_by_vector.csv.")
    title = f"{formatting.titled(metric)} by vector, with 95 % intervals.{others}"
    return ReportTable(metric, title, head, rows, exact_head, exact)


def compared(metric: str, found: list[Contrast]) -> ReportTable:
    """The paired comparisons of a metric."""
    rows: list[list[Cell | Shown]] = []
    exact: list[list[Cell]] = []
    for one in found:
        pair, words = one.paired, [one.axis, one.first, one.second, one.where]
        chances = [pair.t_p, one.p, pair.wilcoxon_p]
        rows.append([*words, pair.difference.mean,
                     formatting.between(pair.difference.low, pair.difference.high),
                     pair.difference.n, *(Shown(formatting.probability(p), p) for p in chances),
                     pair.cohen_dz, pair.rank_biserial,
                     f"{pair.above} / {pair.equal} / {pair.below}"])
        exact.append([*words, *pair.difference[:4], *chances, *pair[3:]])
    return ReportTable(
        f"{metric}_comparisons",
        f"{formatting.titled(metric)}: first minus second under common random numbers. p of "
        "the paired t test, the same after Holm's correction over this table, p of "
        "Wilcoxon's test; Cohen's d_z and the rank-biserial correlation; for how many "
        "seeds the first is above, equal, below.",
        ["parameter", "first", "second", "at", "difference", "95 % interval", "seeds",
         "p", "p (Holm)", "p (Wilcoxon)", "d_z", "r", "> / = / <"], rows,
        ["parameter", "first", "second", "at", "difference", "low", "high", "seeds", "p",
         "p_holm", "p_wilcoxon", "cohen_dz", "rank_biserial", "above", "equal", "below"],
        exact)


def vector_head(study: Study) -> list[str]:
    """The head of a table's first columns, which say which vector a row is about."""
    return ["vector", *study.axes, "runs",
            "reached" if study.has_aim else "finished", "failed"]


def vector_cells(study: Study, vector: VectorRuns) -> list[Cell | Shown]:
    """The cells of a vector in these columns."""
    rows = vector.rows
    return [vector.number, *(
        Shown(axis.label(vector), float(axis.numbers[vector.levels[name]])) if axis.is_numeric
        else axis.label(vector) for name, axis in study.axes.items()),
        len(rows), int(study.reached[rows].sum()), int(study.failed[rows].sum())]


def exact_vector_head(study: Study) -> list[str]:
    """The head for programs: that of the table, and a column of numbers for each axis with a unit.
    """
    return [*vector_head(study), *(axis.title for axis in _with_units(study))]


def exact_vector_cells(study: Study, vector: VectorRuns) -> list[Cell]:
    """The cells of a vector under that head."""
    words = [cell.text if isinstance(cell, Shown) else cell for cell in vector_cells(study, vector)]
    return [*words, *(float(axis.numbers[vector.levels[axis.name]])
                      for axis in _with_units(study))]


def _with_units(study: Study) -> list[Axis]:
    return [axis for axis in study.axes.values() if axis.unit]


def _times(one: Estimate) -> tuple[list[Cell | Shown], list[Cell]]:
    if one.times is None:
        return [None, None], [None] * 8
    median, mean, limit = one.times.median, one.times.successes, one.times.limit
    text = formatting.number(median.value) if median.value is not None \
        else f"> {formatting.number(limit)}"
    if median.low is not None or median.high is not None:
        text += f" [{formatting.number(median.low)}, {formatting.number(median.high)}]"
    return ([Shown(text, limit if median.value is None else median.value),
             Shown(f"{formatting.number(mean.mean)} of {mean.n}", mean.mean)],
            [*median, *mean[:4], limit])


def _means(study: Study, estimates: Estimates, metric: str) -> Means:
    """The means of a metric: of a presented one, those of its figure where that is fast enough."""
    if metric not in study.design.report.metrics or len(study.vectors) > _WIDE_FOR:
        return estimates.means(metric)
    found = [estimates.of(metric, vector) for vector in study.vectors]
    return Means(*np.array([[one.mean, one.low, one.high, one.n, one.late] for one in found],
                           float).T)


def _with_half(mean: float, low: float, high: float, _: float, late: float) -> str:
    text = formatting.at_least(mean, int(late))
    has_width = not np.isnan(low) and high != low
    return f"{text} ± {formatting.number((high - low) / 2, 2)}" if has_width else text
