"""The parts of messages' latency: stacked bars, a panel for each family of topics."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from desim.middleware.message_ledger import PARTS
from desim.report.campaign.figures.style import INK, PALETTE, WIDTH_IN, colour
from desim.report.campaign.numbers import Study, VectorRuns
from desim.report.campaign.numbers.latencies import TopicLatency
from desim.report.campaign.numbers.lines import evenly

_MOST_PANELS, _MOST_BARS = 12, 12
_BAR_IN = 0.22
_MS = 1e3
_BEYOND = 1.6  # intervals are cut at so many times the longest bar


def latency_figure(study: Study, found: list[TopicLatency]) -> tuple[Figure, str]:
    """The figure, and what its caption has to say about what is left out. ``found`` has a latency
    at least once."""
    shown = [one for one in found if one.latency is not None]
    slowest: dict[str, float] = {}
    for one in shown:
        if one.latency is not None:
            slowest[one.topic] = max(slowest.get(one.topic, 0.0), one.latency.mean or 0.0)
    # What takes no time, on one machine, has no bar; a figure without any has all panels.
    slow = [topic for topic in slowest if slowest[topic]] or list(slowest)
    most = sorted(slow, key=lambda topic: -slowest[topic])[:_MOST_PANELS]
    topics = [topic for topic in slow if topic in most]
    vectors = evenly([vector for vector in study.vectors
                      if any(one.vector is vector for one in shown)], _MOST_BARS)
    columns = min(len(topics), 2)
    rows = -(-len(topics) // columns)
    figure = Figure(figsize=(WIDTH_IN, rows * (_BAR_IN * len(vectors) + 0.75) + 0.7),
                    layout="constrained")
    panels = figure.subplots(rows, columns, sharey=True, squeeze=False).ravel()
    for spare in panels[len(topics):]:
        spare.remove()
    for axes, topic in zip(panels, topics, strict=False):
        _draw(axes, [one for one in shown if one.topic == topic], vectors)
        axes.set(title=topic, xlabel="mean latency [ms]")
        _limit(axes, _MS * slowest[topic])
        axes.grid(visible=False, axis="y")
    panels[0].set_yticks(range(len(vectors)),
                         [study.label(vector) or "all runs" for vector in vectors])
    panels[0].set_ylim(len(vectors) - 0.4, -0.6)
    figure.legend(handles=[_patch(part) for part in map(str, PARTS)
                           if any(part in one.parts_s for one in shown)],
                  loc="outside upper left", ncols=5, columnspacing=1.4, handlelength=1.4)
    left = [f"{drawn} of {of} {what}" for drawn, of, what in (
        (len(topics), len(slowest), "topics, the slowest"),
        (len(vectors), len({one.vector.number for one in shown}), "vectors")) if drawn < of]
    return figure, f"Drawn: {' and '.join(left)}; the table has all. " if left else ""


def _draw(axes: Axes, found: list[TopicLatency], vectors: list[VectorRuns]) -> None:
    place = {vector.number: i for i, vector in enumerate(vectors)}
    for one in found:
        if one.vector.number not in place or one.latency is None:
            continue
        y, begin_ms = place[one.vector.number], 0.0
        for part in map(str, PARTS):
            length_ms = _MS * one.parts_s.get(part, 0.0)
            axes.barh(y, length_ms, 0.72, begin_ms, color=_colour(part), hatch=_hatch(part),
                      edgecolor="white", linewidth=0.4)
            begin_ms += length_ms
        low, high = one.latency.low, one.latency.high
        if low is not None and high is not None:
            axes.plot([_MS * max(low, 0.0), _MS * high], [y, y], color=INK, linewidth=1.0)


def _limit(axes: Axes, longest_ms: float) -> None:
    """Begin at 0, with room behind the longest bar, and cut what reaches far beyond it."""
    farthest_ms = max(axes.get_xlim()[1], 1.05 * longest_ms)
    axes.set_xlim(0.0, min(farthest_ms, _BEYOND * longest_ms) or 1.0)


def _patch(part: str) -> Patch:
    return Patch(facecolor=_colour(part), hatch=_hatch(part), edgecolor="white", linewidth=0.4,
                 label=part)


def _colour(part: str) -> str:
    return colour(list(map(str, PARTS)).index(part))


def _hatch(part: str) -> str:
    """Stripes where the colours repeat."""
    return "////" if list(map(str, PARTS)).index(part) >= len(PALETTE) else ""
