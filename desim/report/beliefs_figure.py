"""A picture of the beliefs of all hosts about each other, beside the truth."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from desim.report.drawing import drawing
from desim.report.picture_file import save
from desim.results.beliefs import BeliefSnapshot, PairBelief

_NOBODY, _STOPPED = "#ffffff", "#d5d8dc"
_SEES = {"online": "#b7dfb9", "offline": "#f6c177", "removed": "#b08bbb", "never": "#eceef1"}
_REACHED = {True: ("#b7dfb9", "in reach of each other"), False: ("#f6c177", "out of reach"),
            None: ("#eceef1", "not kept")}
_MISTAKEN = "#d62728"
# What is drawn in a cell: marker, its face and edge, what the legend says.
_MARKS = {"known": ("o", "#2b2f36", "#2b2f36", "all matches known"),
          "missing": ("o", "#ffffff", "#2b2f36", "a match missing"),
          "ghosts": ("X", _MISTAKEN, _MISTAKEN, "a ghost")}


@drawing({"font.size": 9, "axes.titlesize": 10})
def draw(beliefs: BeliefSnapshot, path: Path) -> None:
    """Write the picture to ``path``; its ending says the format (png, pdf, svg)."""
    save(drawn(beliefs), path)


def drawn(beliefs: BeliefSnapshot) -> Figure:
    """The picture: two tables with one row per believer and one column per host. On the left
    the state that the believer assumes of the host, with a mark for the matches that it knows; on
    the right the truth."""
    count = len(beliefs.up)
    side_inch = max(3.2, count * min(0.5, max(0.19, 4.5 / count)))
    figure = Figure(figsize=(2 * side_inch + 2.2, side_inch + 2.7), dpi=130, layout="constrained")
    size = 20.0 * min(1.0, side_inch / count / 0.4)
    believed, true = figure.subplots(1, 2)
    _believed(believed, beliefs, size)
    _true(true, beliefs, size)
    figure.suptitle(beliefs.headline, fontsize=10)
    return figure


def _believed(axes: Axes, beliefs: BeliefSnapshot, size: float) -> None:
    _table(axes, beliefs, lambda view: _SEES.get(view.sees, _SEES["never"]), size)
    _marks(axes, beliefs, size)
    axes.set(title="(a) What each host believes", ylabel="believer")
    _legend_below(axes, [
        *(Patch(facecolor=colour, edgecolor="grey", label=f"seen {state}" if state != "never"
                else "never seen") for state, colour in _SEES.items()),
        *(Line2D([], [], linestyle="none", marker=marker, markerfacecolor=face, markersize=6,
                 markeredgecolor=edge, label=label) for marker, face, edge, label
          in _MARKS.values()),
        Patch(facecolor="none", edgecolor=_MISTAKEN, linewidth=1.5, label="not so in truth")])


def _true(axes: Axes, beliefs: BeliefSnapshot, size: float) -> None:
    place = {host: i for i, host in enumerate(beliefs.up)}
    _table(axes, beliefs, lambda view: _REACHED[view.reached][0] if beliefs.up[view.other]
           else _STOPPED, size)
    for view in beliefs.views:
        if view.known or view.missing:
            axes.scatter(place[view.other], place[view.believer], s=size, color="#2b2f36",
                         linewidth=0.8, zorder=3)
    axes.set_title("(b) The truth")
    _legend_below(axes, [
        *(Patch(facecolor=colour, edgecolor="grey", label=label)
          for reached, (colour, label) in _REACHED.items()
          if any(view.reached is reached for view in beliefs.views)),
        Patch(facecolor=_STOPPED, edgecolor="grey", label="host has stopped"),
        Line2D([], [], linestyle="none", marker="o", color="#2b2f36", markersize=6,
               label="there are matches")])


def _legend_below(axes: Axes, handles: list[Artist]) -> None:
    axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.02), ncols=2,
                frameon=False, fontsize=8.5)


def _table(axes: Axes, beliefs: BeliefSnapshot, colour: Callable[[PairBelief], str],
           size: float) -> None:
    hosts = list(beliefs.up)
    place = {host: i for i, host in enumerate(hosts)}
    colours = [_NOBODY, _STOPPED]
    shown = np.zeros((len(hosts), len(hosts)), np.int64)
    for view in beliefs.views:
        own = colour(view) if beliefs.up[view.believer] else _STOPPED
        if own not in colours:
            colours.append(own)
        shown[place[view.believer], place[view.other]] = colours.index(own)
    axes.imshow(shown, cmap=ListedColormap(colours), vmin=0, vmax=len(colours) - 1)
    ticks = range(len(hosts))
    labels = [host if up else f"{host} (stopped)" for host, up in beliefs.up.items()]
    axes.set_xticks(ticks, labels, rotation=90)
    axes.set_yticks(ticks, labels)
    axes.set_xticks(np.arange(len(hosts) + 1) - 0.5, minor=True)
    axes.set_yticks(np.arange(len(hosts) + 1) - 0.5, minor=True)
    axes.grid(which="minor", color="white", linewidth=1.0)
    axes.tick_params(which="both", length=0, labelsize=6.0 + 0.1 * size, top=False,
                     labeltop=True, labelbottom=False)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _marks(axes: Axes, beliefs: BeliefSnapshot, size: float) -> None:
    place = {host: i for i, host in enumerate(beliefs.up)}
    for view in beliefs.views:
        row, column = place[view.believer], place[view.other]
        kinds = ["missing" if view.missing else "known"] if view.known or view.missing else []
        kinds += ["ghosts"] if view.ghosts else []
        for i, kind in enumerate(kinds):
            marker, face, edge, _ = _MARKS[kind]
            shift = 0.0 if len(kinds) == 1 else 0.22 * (2 * i - 1)
            axes.scatter(column + shift, row, s=size * (1.6 if kind == "ghosts" else 1.0),
                         marker=marker, facecolor=face, edgecolor=edge, linewidth=0.8, zorder=3)
        if view.mistaken:
            axes.add_patch(Rectangle((column - 0.44, row - 0.44), 0.88, 0.88, fill=False,
                                     edgecolor=_MISTAKEN, linewidth=1.2, zorder=2))
