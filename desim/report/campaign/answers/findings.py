"""The findings of a campaign at a glance: a table of all metrics and lines, and a few sentences."""

from __future__ import annotations

from collections import Counter

from desim.blame import cause_of
from desim.report.campaign import formatting
from desim.report.campaign.numbers import Estimates, Study, VectorRuns
from desim.report.campaign.numbers.contrasts import Contrast, strongest
from desim.report.campaign.numbers.knees import LineKnees, interval
from desim.report.campaign.tables.table import Cell, ReportTable

_MOST_SAID = 6  # places of a kind
_MOST_COLUMNS = 4


def glance(study: Study, estimates: Estimates,
           bends: dict[str, list[LineKnees]]) -> ReportTable | None:
    """A table of each metric's means along the axis and of its knees, one column per line of the
    figure (if there are many, one row). None if the axis has no numbers or only one value."""
    axis = study.against
    if axis is None or not axis.is_numeric or len(axis.labels) < 2 or not any(bends.values()):
        return None
    places = [bend.place for bend in next(iter(bends.values()))]
    ends = f"{axis.name} {axis.labels[0]} → {axis.labels[-1]}"
    rows: list[list[Cell]]
    if len(places) <= _MOST_COLUMNS:
        head = ["metric", *(place or ends for place in places)]
        rows = [[formatting.titled(metric),
                 *(_along(study, estimates, metric, bend) for bend in found)]
                for metric, found in bends.items()]
    else:
        head = ["metric", "line", ends]
        rows = [[formatting.titled(metric), bend.place, _along(study, estimates, metric, bend)]
                for metric, found in bends.items() for bend in found]
    exact: list[list[Cell]] = [[metric, bend.place, *knee] for metric, found in bends.items()
                               for bend in found for knee in bend.knees]
    return ReportTable(
        "knees", f"Means at {ends}; below them where the line bends, with the 95 % "
        "interval of that place.", head, rows,
        ["metric", "line", "at", "low", "high", "slope_before", "slope_after", "p", "n"], exact)


def _along(study: Study, estimates: Estimates, metric: str, bend: LineKnees) -> str:
    """The means at both ends of a line, and its knees."""
    ends = [estimates.of(metric, bend.line.vectors[end]) for end in (0, -1)]
    text = " → ".join(f"{formatting.at_least(one.mean, one.late, 3)} (n = {one.n})" for one in ends)
    if not bend.knees:
        return f"{text}\nno knee" if bend.was_sought else text
    return "\n".join([text, *(f"knee {formatting.quantity(knee.at, study.axis.unit)} "
                              f"({interval(knee, study.axis)})" for knee in bend.knees)])


def failed(study: Study) -> list[str]:
    """Sentences about failed runs: their number, the most frequent cause, and vectors in which all
    failed."""
    causes = causes_of(study)
    if not causes:
        return []
    count, total = causes.total(), int(study.once.sum())
    cause, often = causes.most_common(1)[0]
    many = f"All {total} runs" if count == total else f"{count} of {total} runs"
    sentences = [f"{many if total > 1 else 'The run'} failed: {cause}." if len(causes) == 1 else
            f"{many} failed, for {len(causes)} causes; the most frequent one, of {often}: {cause}."]
    none = [vector for vector in study.vectors if study.failed[vector.rows].all()]
    if none and len(none) < len(study.vectors):
        sentences.append(f"All runs failed in {len(none)} of "
                    f"{formatting.counted(len(study.vectors), 'vector')}: {_named(study, none)}.")
    return sentences


def causes_of(study: Study) -> Counter[str]:
    """The number of failures by cause, no matter of which host and when."""
    return Counter(cause_of(error or "no reason is known") for error in
                   study.text("error")[study.once & study.failed])


def unreached(study: Study) -> list[str]:
    """A sentence about vectors in which no finished run reached the aim."""
    tried = [vector for vector in study.vectors if not study.failed[vector.rows].all()]
    never = [vector for vector in tried if not study.reached[vector.rows].any()]
    which = "run that finished" if study.failed.any() else "run"
    if never and len(never) == len(tried):
        return [f"No {which} reached the aim."]
    return [f"No {which} reached the aim in {len(never)} of "
            f"{formatting.counted(len(study.vectors), 'vector')}: {_named(study, never)}."] \
        if never else []


def significant(found: dict[str, list[Contrast]]) -> list[str]:
    """A sentence: the number of significant comparisons of each metric."""
    counts = [f"{formatting.titled(metric)} in {len(strongest(pairs))} of {len(pairs)}"
              for metric, pairs in found.items() if strongest(pairs)]
    return [f"Significant differences, pair by pair after Holm's correction: "
            f"{formatting.listed(counts)}."] if counts else []


def largest_effect(metric: str, found: list[Contrast]) -> str:
    """The largest effect of a metric in words; empty where none is significant."""
    clear = strongest(found)
    if not clear:
        return ""
    one, pair = clear[0], clear[0].paired
    p = formatting.probability(one.p)
    return (f"{formatting.titled(metric)}: {len(clear)} of "
            f"{formatting.counted(len(found), 'comparison')} significant after Holm's correction; "
            f"the clearest: {one.axis} {one.first} minus {one.second}"
            f"{f' at {one.where}' if one.where else ''}, "
            f"{formatting.number(pair.difference.mean)} "
            f"{formatting.between(pair.difference.low, pair.difference.high)}, d_z "
            f"{formatting.number(pair.cohen_dz, 3)}, p {p if p.startswith('<') else f'= {p}'} "
            f"({formatting.counted(pair.difference.n, 'seed')}).")


def _named(study: Study, vectors: list[VectorRuns]) -> str:
    """The names of some vectors, line by line."""
    if study.is_sampled or study.against is None:
        return formatting.listed([study.label(vector) for vector in vectors], _MOST_SAID)
    by_line: dict[str, list[str]] = {}
    rest = [axis for axis in study.axes.values() if axis is not study.against]
    for vector in vectors:
        place = f"{study.label(vector, *rest)}, " if rest else ""
        by_line.setdefault(place, []).append(study.against.label(vector))
    lines = [f"{place}{study.against.name} = {formatting.listed(labels)}"
             for place, labels in by_line.items()]
    return "; ".join(lines[:_MOST_SAID]) + ("; ..." if len(lines) > _MOST_SAID else "")
