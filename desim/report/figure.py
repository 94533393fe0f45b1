"""One picture of a run: where the fleet drove, what it knew, how fast it learned, what it sent."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure

from desim.api import Run
from desim.experiment.maps import OccupancyMap
from desim.experiment.metrics import EXPLORED

NAMED = 10  # up to so many robots have a line each in the legend, more share a colour bar

_UNKNOWN, _FREE, _SOLID, _WRONG = "#c9cdd2", "#ffffff", "#2b2f36", "#d62728"
_PREFIX = "bytes_per_s:"


def draw(run: Run, path: Path) -> None:
    """Write the picture of ``run`` to ``path``; its ending says the format (png, pdf, svg)."""
    figure = Figure(figsize=(13, 11), dpi=130, layout="constrained")
    (where, what), (when, said) = figure.subplots(2, 2)
    robots = list(dict.fromkeys(run.robots["robot"].tolist()))
    palette = colormaps["turbo"](np.linspace(0.05, 0.95, max(len(robots), 2)))
    colours = dict(zip(robots, palette, strict=False))
    _trajectories(where, run, colours)
    _knowledge(what, run)
    _explored(when, run, colours)
    _traffic(said, run)
    if len(robots) > NAMED:
        scale = ScalarMappable(Normalize(0, len(robots) - 1),
                               ListedColormap(palette[:len(robots)]))
        figure.colorbar(scale, ax=[where], label=f"robot, {robots[0]} to {robots[-1]}",
                        location="left", shrink=0.7)
    metrics, manifest = run.metrics, run.manifest
    figure.suptitle(f"{manifest['name']}, seed {manifest['seed']}: {len(robots)} robots, "
                    f"{metrics['simulated_s']:.1f} s, {metrics['stop_reason']}"
                    f"{'' if manifest['status'] == 'finished' else ', ' + manifest['status']}",
                    fontsize=14)
    figure.savefig(path)


def _trajectories(axes: Axes, run: Run, colours: dict[str, np.ndarray]) -> None:
    _raster(axes, run.truth)
    rows = run.robots
    for name, colour in colours.items():
        own = rows["robot"] == name
        x_m, y_m = rows["x_m"][own], rows["y_m"][own]
        axes.plot(x_m, y_m, color=colour, linewidth=1.0, label=name)
        axes.plot(x_m[:1], y_m[:1], "o", color=colour, markersize=4, markeredgecolor="black",
                  markeredgewidth=0.4)
        axes.plot(x_m[-1:], y_m[-1:], "s", color=colour, markersize=5, markeredgecolor="black",
                  markeredgewidth=0.6)
    axes.set_title("Terrain and trajectories (circle: start, square: end)")
    if len(colours) <= NAMED:
        axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.09), ncols=min(len(colours), 5),
                    fontsize=8, frameon=False, borderaxespad=0.0)


def _knowledge(axes: Axes, run: Run) -> None:
    cells = run.map.cells
    _raster(axes, run.map)
    known = cells >= 0
    wrong = known & ((cells > 0) != (run.truth.cells > 0))
    axes.imshow(np.ma.masked_where(~wrong, wrong), cmap=ListedColormap([_WRONG]), vmin=0, vmax=1,
                origin="lower", extent=run.map.extent_m, interpolation="nearest")
    metrics = run.metrics
    axes.set_title(f"Map of {metrics['judged_robot']}: {metrics['map_completeness']:.2%} complete, "
                   f"{metrics['map_error_cells']} wrong cells (red)")


def _explored(axes: Axes, run: Run, colours: dict[str, np.ndarray]) -> None:
    rows, metrics, count = run.robots, run.metrics, len(colours)
    time_s = rows["time_s"][::count]
    shares = 100.0 * rows["explored"].reshape(-1, count)
    for i, colour in enumerate(colours.values()):
        axes.plot(time_s, shares[:, i], color=colour, linewidth=0.7, alpha=0.7)
    # A robot without software knows nothing, NaN; fmax and fmin leave it out.
    for share, style, label in ((100.0 * rows["explored_union"][::count], "-", "union of all"),
                                (np.fmax.reduce(shares, axis=1), "--", "best robot"),
                                (np.fmin.reduce(shares, axis=1), ":", "least informed robot")):
        axes.plot(time_s, share, style, color="black", linewidth=1.6, label=label)
    axes.axhline(100.0 * EXPLORED, color="grey", linewidth=0.8)
    reached_s = metrics["exploration_time_s"]
    if reached_s is not None:
        axes.axvline(reached_s, color="grey", linewidth=0.8)
        axes.annotate(f"99 % at {reached_s:.1f} s", (reached_s, 5.0), xytext=(-6, 0),
                      textcoords="offset points", ha="right", fontsize=9)
    axes.set(title="Explored share (thin: each robot)", xlabel="simulated time [s]",
             ylabel="share of the reachable area [%]", ylim=(0.0, 103.0),
             xlim=(0.0, max(metrics["simulated_s"], 1e-9)))
    axes.grid(alpha=0.3)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.1), fontsize=9)


def _traffic(axes: Axes, run: Run) -> None:
    samples = run.samples
    families = sorted((name for name in samples if name.startswith(_PREFIX)),
                      key=lambda name: -samples[name].max())
    for name in families:
        # A row has the mean since the row before.
        axes.plot(samples["time_s"], 1e-3 * samples[name], linewidth=1.3, drawstyle="steps-pre",
                  label=name.removeprefix(_PREFIX))
    axes.set(title="Delivered between hosts, by topic (* is any robot)",
             xlabel="simulated time [s]", ylabel="kB/s (1000 bytes, without headers)",
             xlim=(0.0, max(run.metrics["simulated_s"], 1e-9)))
    axes.grid(alpha=0.3)
    if any(samples[name].max() > 0.0 for name in families):
        axes.set_yscale("symlog", linthresh=0.1)
        axes.set_ylim(0.0, 3e-3 * max(samples[name].max() for name in families))
        axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.1), ncols=3, fontsize=9,
                    frameon=False, borderaxespad=0.0)
    else:
        axes.text(0.5, 0.5, "no messages between hosts", transform=axes.transAxes, ha="center")


def _raster(axes: Axes, drawn: OccupancyMap) -> None:
    shade = np.where(drawn.cells < 0, 0, np.where(drawn.cells > 0, 2, 1))
    # Mixed as colours, so that a wall of one cell does not fall between two pixels.
    axes.imshow(shade, cmap=ListedColormap([_UNKNOWN, _FREE, _SOLID]), vmin=0, vmax=2,
                origin="lower", extent=drawn.extent_m, interpolation="antialiased",
                interpolation_stage="rgba")
    axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
