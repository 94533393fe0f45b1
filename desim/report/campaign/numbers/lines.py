"""The panels and lines of a figure, which are made of vectors."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple, TypeVar

from desim.report.campaign.numbers.study import Study, VectorRuns

# The most that a figure holds. The report says what is left out, and the tables have it.
MOST_PANELS = 12
_MOST_LINES = 12
_MOST_POINTS = 200  # of a line
_MOST_VECTORS = 1500


class PlotLine(NamedTuple):
    """A line of a figure: ``vectors`` in the order of the axis, ``style`` for colour and symbol."""

    label: str
    style: int
    vectors: list[VectorRuns]


class Panel(NamedTuple):
    """A panel of a figure. ``title``: the levels of the parameters that are neither along the axis
    nor distinguish lines."""

    title: str
    lines: list[PlotLine]

    def place(self, line: PlotLine) -> str:
        """The name of one of its lines among all lines of all panels."""
        return ", ".join(filter(None, [self.title, line.label]))


def panels(study: Study) -> list[Panel]:
    """All panels with all lines, in the order of the levels."""
    against, by = study.against, study.by
    if against is None:
        return [Panel("", [PlotLine("", 0, study.vectors)])]
    found: dict[tuple[int, ...], dict[int, list[VectorRuns]]] = defaultdict(
        lambda: defaultdict(list))
    for vector in study.vectors:
        of = tuple(vector.levels[axis.name] for axis in study.others)
        found[of][vector.levels[by.name] if by else 0].append(vector)
    made = []
    for of in sorted(found):
        lines = [PlotLine(f"{by.name} = {by.labels[level]}" if by and len(by.labels) > 1 else "",
                      level, sorted(vectors, key=lambda one: one.levels[against.name]))
                 for level, vectors in sorted(found[of].items())]
        title = ", ".join(f"{axis.name} = {axis.labels[level]}"
                          for axis, level in zip(study.others, of, strict=True))
        made.append(Panel(title, lines))
    return made


T = TypeVar("T")


def chosen(found: list[Panel]) -> list[Panel]:
    """The part of the panels that a figure shows: the first panels, of each some lines, of each
    line some points, evenly spread."""
    some = found[:MOST_PANELS]
    longest = max(len(line.vectors) for panel in some for line in panel.lines)
    most_lines = _MOST_VECTORS // (len(some) * min(longest, _MOST_POINTS))
    return [Panel(panel.title, [
        PlotLine(line.label, line.style, evenly(line.vectors, _MOST_POINTS))
        for line in evenly(panel.lines, min(max(most_lines, 1), _MOST_LINES))]) for panel in some]


def left_out(found: list[Panel], drawn: list[Panel]) -> str:
    """A sentence about the panels that are not drawn; empty if all are."""
    before, after = ([len(panels), sum(len(panel.lines) for panel in panels),
                      sum(len(line.vectors) for panel in panels for line in panel.lines)]
                     for panels in (found, drawn))
    parts = [f"{few} of {many} {what}" for few, many, what in
             zip(after, before, ("panels", "lines", "vectors"), strict=True) if few < many]
    return f"Drawn: {', '.join(parts)}; the tables have all. " if parts else ""


def evenly(items: Sequence[T], most: int) -> list[T]:
    """At most so many of the items, with the same distance between them, the ends among them."""
    if len(items) <= most:
        return list(items)
    return [items[round(i * (len(items) - 1) / max(most - 1, 1))] for i in range(most)]
