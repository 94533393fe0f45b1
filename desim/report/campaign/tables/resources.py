"""The table of resources: what saturated first in the runs of each vector, and how full it was."""

from __future__ import annotations

from collections import Counter

import numpy as np

from desim.report.campaign import formatting
from desim.report.campaign.numbers import Study, VectorRuns
from desim.report.campaign.tables.overview import (
    exact_vector_cells,
    exact_vector_head,
    vector_cells,
    vector_head,
)
from desim.report.campaign.tables.table import ReportTable, Shown

_FIRST = "saturated_first"
_PEAK = ("saturation_", "_peak")
NONE = "none"


def first_by_vector(study: Study) -> list[Counter[str]]:
    """The runs of each vector by the resource that saturated first; ``NONE`` where none did. Empty
    if no run has measured it."""
    if not any(metric.startswith(_PEAK[0]) for metric in study.metrics):
        return []
    words = study.text(_FIRST)
    return [Counter(words[row] or NONE for row in vector.rows if not study.failed[row])
            for vector in study.vectors]


def sentences(study: Study) -> list[str]:
    """A sentence: what saturated first, in how many runs. Empty if nothing did."""
    total = sum(first_by_vector(study), Counter[str]())
    gave_in = total - Counter({NONE: total[NONE]})
    if not gave_in:
        return []
    often = [f"{name} in {count}" for name, count in gave_in.most_common()]
    return [f"Resource that saturated first, of {total.total()} runs: {formatting.listed(often)}"
            f"{f'; none in {total[NONE]}' if total[NONE] else ''}."]


def resources_table(study: Study) -> ReportTable | None:
    """A table by vector: what saturated first, and the mean of each resource's peak. None if no run
    has measured them."""
    found = first_by_vector(study)
    if not found:
        return None
    peaks = [metric for metric in study.metrics
             if metric.startswith(_PEAK[0]) and metric.endswith(_PEAK[1])]
    rows, exact = [], []
    for vector, first in zip(study.vectors, found, strict=True):
        means = [_mean(study, metric, vector) for metric in peaks]
        often = ", ".join(f"{name} {count}{_parts(study, name, vector)}"
                          for name, count in first.most_common())
        rows.append([*vector_cells(study, vector), often, *(
            Shown("–" if mean is None else f"{mean:.1%}", mean) for mean in means)])
        exact.append([*exact_vector_cells(study, vector), often, *means])
    names = [metric.removeprefix(_PEAK[0]).removesuffix(_PEAK[1]) for metric in peaks]
    return ReportTable(
        "saturated_first", "The resource that saturated first and in how many runs, by vector; and "
        "of each resource the largest share that was in use for 5 s, as a mean over the runs.",
        [*vector_head(study), "first", *names], rows,
        [*exact_vector_head(study), "first", *peaks], exact)


def _parts(study: Study, name: str, vector: VectorRuns) -> str:
    """The parts of a resource that saturated first, with the number of runs, in brackets."""
    column = f"saturation_{name}_part"
    if column not in study.columns:
        return ""
    found = Counter(part for part, first in zip(study.text(column)[vector.rows],
                                                study.text(_FIRST)[vector.rows], strict=True)
                    if part is not None and first == name)
    return " (" + ", ".join(f"{part}: {count}" for part, count in found.most_common()) + ")" \
        if found else ""


def _mean(study: Study, metric: str, vector: VectorRuns) -> float | None:
    values = study.column(metric)[vector.rows]
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else None
