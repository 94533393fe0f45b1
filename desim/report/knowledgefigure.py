"""Who knows whom, as a picture."""

from __future__ import annotations

import math
from pathlib import Path

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyArrowPatch

from desim.experiment.knowledge import Knowledge
from desim.report.figure import save
from desim.report.knowledge import headline

# By column of a view: colour, line style, bend of the arrow, what the legend says.
_KINDS = {"known": ("#2b6cb0", "-", 0.06, "known match"),
          "missing": ("#9aa0a6", ":", 0.16, "match not known"),
          "ghosts": ("#d62728", "--", 0.26, "ghost")}
_NODE_INCH = 0.25  # radius


@rc_context({"font.size": 9})
def draw(knowledge: Knowledge, path: Path) -> None:
    """Write the picture to ``path``; its ending says the format (png, pdf, svg).

    Hosts stand on a circle, dashed where they have stopped. Arrows go the way of the messages,
    from the publisher to the subscriber, one for all topics of a pair; wider ones stand for more.
    """
    count = len(knowledge.up)
    side_inch = max(5.0, 2.2 + 0.3 * count)
    radius = _NODE_INCH * 2.0 / (side_inch - 1.2)
    figure = Figure(figsize=(side_inch, side_inch), dpi=130, layout="constrained")
    axes = figure.subplots()
    axes.set(xlim=(-1.2, 1.2), ylim=(-1.2, 1.2), aspect="equal")
    axes.set_axis_off()
    nodes = {}
    for i, (host, up) in enumerate(knowledge.up.items()):
        angle = 2 * math.pi * i / count
        at = math.sin(angle), math.cos(angle)
        nodes[host] = axes.add_patch(Circle(
            at, radius, facecolor="#e8f0fe" if up else "white", edgecolor="#2b2f36",
            linestyle="-" if up else "--", zorder=3))
        axes.annotate(host.replace("_", "\n"), at, ha="center", va="center", zorder=4,
                      fontsize=6.5, color="black" if up else "#9aa0a6")
    _arrows(axes, knowledge, nodes)
    axes.legend(handles=[Line2D([], [], color=colour, linestyle=style, label=label)
                         for colour, style, _, label in _KINDS.values()],
                loc="lower center", bbox_to_anchor=(0.5, -0.06), ncols=3, frameon=False)
    figure.suptitle(headline(knowledge), fontsize=10)
    save(figure, path)


def _arrows(axes: Axes, knowledge: Knowledge, nodes: dict[str, Circle]) -> None:
    for view in knowledge.views:
        ends = [nodes[view.believer], nodes[view.other]]
        if knowledge.informed == "subscriber":
            ends.reverse()
        for kind, (colour, style, bend, _) in _KINDS.items():
            topics = len(getattr(view, kind))
            if topics:
                axes.add_patch(FancyArrowPatch(
                    ends[0].center, ends[1].center, patchA=ends[0], patchB=ends[1],
                    color=colour, linestyle=style, arrowstyle="-|>", mutation_scale=7,
                    linewidth=0.6 + 0.3 * min(topics, 4), alpha=0.8, zorder=2,
                    connectionstyle=f"arc3,rad={bend}"))
