"""Whether settings rank alike on every rung of the fidelity ladder."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from desim.report.campaign import formatting
from desim.report.campaign.numbers import Estimates, Study
from desim.report.campaign.numbers.contrasts import FEWEST_SEEDS, by_iteration
from desim.report.campaign.tables.table import Cell, ReportTable, Shown
from desim.statistics.ranking import Flip, Kendall, flips, kendall

FIDELITY = "network.fidelity"


class Rung(NamedTuple):
    """The ``means`` by setting on one rung, and their ranking against that of the highest rung;
    None where results of a setting are missing. Of times, ``late`` values of each setting count
    with the limit. ``seeds`` is the number that all settings share."""

    name: str
    means: tuple[float | None, ...]
    late: tuple[int, ...]
    kendall: Kendall | None
    flips: list[Flip]
    seeds: int


def is_ladder(study: Study) -> bool:
    """Whether the axis is the ladder, with several settings to compare on it."""
    against, by = study.against, study.by
    return (against is not None and by is not None and len(by.labels) > 1 and not study.others
            and not study.is_sampled
            and getattr(study.design.parameters[against.name], "key", None) == FIDELITY)


def compared(study: Study, estimates: Estimates, metric: str) -> list[Rung]:
    """Each rung, compared with the last one of the design."""
    axis, by = study.axis, study.setting
    vectors = {(vector.levels[axis.name], vector.levels[by.name]): vector
               for vector in study.vectors}
    values: list[np.ndarray | None] = []
    late: list[tuple[int, ...]] = []
    for rung in range(len(axis.labels)):
        there = [vectors.get((rung, setting)) for setting in range(len(by.labels))]
        late.append(tuple(estimates.of(metric, one).late if one else 0 for one in there))
        by_seed = [by_iteration(study, estimates, metric, one) if one else {} for one in there]
        shared = sorted(set.intersection(*(set(one) for one in by_seed)))
        values.append(np.array([[one[k] for k in shared] for one in by_seed]) if shared else None)
    highest = values[-1]
    out = []
    for name, own, over in zip(axis.labels, values, late, strict=True):
        if own is None or highest is None:
            known = (None,) * len(by.labels) if own is None else tuple(own.mean(axis=1).tolist())
            out.append(Rung(name, known, over, None, [], 0))
        else:
            means = own.mean(axis=1)
            out.append(Rung(name, tuple(means.tolist()), over, kendall(
                means, highest.mean(axis=1)), flips(own, highest), own.shape[1]))
    return out


def sentences(study: Study, metric: str, found: list[Rung]) -> list[str]:
    """The ranking in words."""
    labels, highest = study.setting.labels, found[-1]
    if highest.kendall is None:
        return [f"The highest rung, {highest.name}, has no runs to compare with."]
    if highest.kendall.tau is None:
        return [f"On the highest rung, {highest.name}, all levels have the same "
                f"{formatting.titled(metric)}: there is no ranking that others could hold."]
    below, out = found[:-1], []
    if not any(rung.flips for rung in below):
        held = [rung.name for rung in below if rung.kendall and rung.kendall.tau is not None]
        fewest = min(rung.seeds for rung in found)
        hint = "" if fewest >= FEWEST_SEEDS else (
            f" With {formatting.counted(fewest, 'seed')} that is no more than a hint.")
        out.append(f"The ranking by {formatting.titled(metric)} on {highest.name} holds on "
                   f"{formatting.listed(held)}.{hint}")
    for rung in below:
        pairs = [f"{labels[flip.i]} and {labels[flip.j]} "
                 f"({'significant' if flip.significant else 'not significant'}, p "
                 f"{formatting.probability(flip.p)})" for flip in rung.flips]
        if pairs:
            out.append(f"{rung.name} flips {formatting.listed(pairs)} against {highest.name}.")
    tied = [rung.name for rung in below if rung.kendall and rung.kendall.tau is None]
    if tied:
        out.append(f"On {formatting.listed(tied)} all levels come to the same.")
    lacking = [rung.name for rung in below if rung.kendall is None]
    if lacking:
        out.append(f"Without results for every level: {formatting.listed(lacking)}.")
    return out


def table(study: Study, metric: str, found: list[Rung]) -> ReportTable:
    """Means, Kendall's tau and the pairs that are turned over."""
    labels = study.setting.labels
    rows: list[list[Cell | Shown]] = []
    exact: list[list[Cell]] = []
    for rung in found:
        tau = None if rung.kendall is None else rung.kendall.tau
        pairs = ", ".join(f"{labels[flip.i]}/{labels[flip.j]}{'*' if flip.significant else ''}"
                          for flip in rung.flips)
        rows.append([rung.name, *(Shown(formatting.at_least(mean, late), mean)
                                  for mean, late in zip(rung.means, rung.late, strict=True)),
                     rung.seeds, Shown(formatting.number(tau, 3), tau), pairs or "none"])
        exact.append([rung.name, *rung.means, rung.seeds, tau, pairs])
    head = ["rung", *labels, "seeds", "Kendall's tau", "flipped"]
    return ReportTable(
        f"{metric}_ladder", f"{formatting.titled(metric)} on the fidelity ladder: means, and "
        f"Kendall's tau of the ranking against that of {found[-1].name}; * a flip that is "
        "significant at 5 % after Holm's correction.", head, rows, head, exact)
