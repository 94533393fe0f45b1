"""One picture of a run: where the fleet drove, what it knew and sent, what loaded its computers."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure, FigureBase
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch

from desim.colours import ROBOTS, of_robot
from desim.monitor.coverage import EXPLORED
from desim.report import load_panels
from desim.report.drawing import drawing
from desim.report.log_axis import plain
from desim.report.picture_file import save
from desim.results.maps import OccupancyMap
from desim.results.run import Run
from desim.results.samples import measured
from desim.results.status import RunStatus

if TYPE_CHECKING:  # the name is new in matplotlib 3.10
    from matplotlib.typing import RcKeyType

NAMED = len(ROBOTS)  # up to so many have a line each in the legend, more share a colour bar

_UNKNOWN, _FREE, _SOLID, _WRONG = "#c9cdd2", "#ffffff", "#2b2f36", "#d62728"
_DOOR, _MOVER, _APART = "#f2b705", "#000000", "#b8a3d9"
_BENDS = 12  # straight pieces that a robot's way of one second is drawn with
_STYLE: dict[RcKeyType, object] = {"font.size": 9, "axes.titlesize": 11, "legend.fontsize": 8.5}
_PREFIX = "bytes_per_s:"
_DASHES = ("-", "--", ":", "-.")  # of each ten lines, whose colours come again


def draw(run: Run, path: Path) -> None:
    """Write the picture of ``run`` to ``path``; its ending says the format (png, pdf, svg)."""
    with drawing(_STYLE):
        save(_figure(run), path)


def png(run: Run, dpi: int) -> bytes:
    """The picture of ``run``, 11 x 10 inches, as a PNG."""
    file = BytesIO()
    with drawing(_STYLE):
        _figure(run).savefig(file, format="png", dpi=dpi)
    return file.getvalue()


def _figure(run: Run) -> Figure:
    loads = "cpu_s" in run.robots  # else computers are ideal
    figure = Figure(figsize=(11, 12.5 if loads else 10), dpi=160, layout="constrained")
    upper: FigureBase = figure
    if loads:
        (upper,), (lower,) = figure.subfigures(2, 1, squeeze=False, height_ratios=(4, 1))
    robots = list(dict.fromkeys(run.robots["robot"].tolist()))
    palette = _palette(len(robots))
    colours = dict(zip(robots, palette, strict=True))
    where, *known, said = (upper.subplots(2, 2) if robots else upper.subplots(1, 2)).flat
    _terrain(where, run, colours)
    if robots:
        _knowledge(known[0], run)
        _explored(known[1], run, colours)
    _traffic(said, run)
    if loads:
        load_panels.draw(lower, run, colours)
    if len(robots) > NAMED:
        scale = ScalarMappable(Normalize(0, len(robots) - 1), ListedColormap(palette))
        upper.colorbar(scale, ax=[where], label=f"robot, {robots[0]} to {robots[-1]}",
                        location="left", shrink=0.7)
    metrics, manifest = run.metrics, run.manifest
    status = "" if manifest["status"] == RunStatus.FINISHED else f", {manifest['status']}"
    figure.suptitle(f"{manifest['name']}, seed {manifest['seed']}: {len(robots) or 'no'} robots, "
                    f"{metrics['simulated_s']:.1f} s, {metrics['stop_reason']}{status}",
                    fontsize=13)
    return figure


def _palette(robots: int) -> np.ndarray:
    """[robots, 4] colours that stand out from white."""
    if robots <= NAMED:
        return np.array([(*of_robot(number), 1.0) for number in range(robots)])
    # turbo's yellow and light green would hardly be seen.
    return colormaps["turbo"](np.linspace(0.0, 1.0, robots)) * (0.82, 0.82, 0.82, 1.0)


def _terrain(axes: Axes, run: Run, colours: dict[str, np.ndarray]) -> None:
    _raster(axes, run.truth)
    keys: list[Artist] = [Patch(color=_SOLID, label="wall")]
    if (run.truth.cells < 0).any():
        keys.append(Patch(color=_UNKNOWN, label="out of reach"))
    keys += _doors(axes, run) + _movers(axes, run) + _ways(axes, run, colours)
    axes.set_title("(a) Terrain" + " and true ways of the robots" * bool(colours))
    _legend_below(axes, handles=keys, ncols=4)


def _ways(axes: Axes, run: Run, colours: dict[str, np.ndarray]) -> list[Artist]:
    rows = run.robots
    keys: list[Artist] = []
    ends = {"start": ("o", 4.0), "end": ("s", 4.5)} if colours else {}
    for name, colour in colours.items():
        own = rows["robot"] == name
        x_m, y_m = rows["x_m"][own], rows["y_m"][own]
        keys += axes.plot(*bent(x_m, y_m, rows["yaw_rad"][own]), color=colour, linewidth=1.0,
                          label=name)
        for at, (marker, size) in zip((0, -1), ends.values(), strict=True):
            axes.plot(x_m[at], y_m[at], marker, color=colour, markersize=size,
                      markeredgecolor="black", markeredgewidth=0.5)
    return [Line2D([], [], linestyle="none", marker=marker, markersize=size, label=label,
                   markerfacecolor="white", markeredgecolor="black")
            for label, (marker, size) in ends.items()] + (keys if len(keys) <= NAMED else [])


def bent(x_m: np.ndarray, y_m: np.ndarray, yaw_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """[n] points and headings as a line that has these headings there: a cubic Hermite spline.

    Results have a pose a second. Straight lines between them are off the true way by up to 19 cm in
    the maze at 1.2 m/s, and cut corners; this is off by 6 cm at most, as straight lines between
    poses at 2 Hz would be, and costs a run nothing.
    """
    if len(x_m) < 2:
        return x_m, y_m
    s = np.arange(_BENDS) / _BENDS
    at = np.stack([2 * s**3 - 3 * s**2 + 1, s**3 - 2 * s**2 + s, 3 * s**2 - 2 * s**3, s**3 - s**2])
    length_m = np.hypot(np.diff(x_m), np.diff(y_m))

    def through(place: np.ndarray, along: np.ndarray) -> np.ndarray:
        ends = [place[:-1], length_m * along[:-1], place[1:], length_m * along[1:]]
        return np.append(np.stack(ends, axis=1) @ at, place[-1])

    return through(x_m, np.cos(yaw_rad)), through(y_m, np.sin(yaw_rad))


def _doors(axes: Axes, run: Run) -> list[Artist]:
    """Draw the doors, which are in no map of the truth, because that takes them as open."""
    keys: dict[str, Artist] = {}
    for door in run.scenario.environment.doors:
        opened = any(start_ns == 0 for start_ns, _ in door.open_ns)
        label = f"door, {'open' if opened else 'closed'} at the start"
        ends_m = zip(door.start_m, door.end_m, strict=True)
        keys[label], = axes.plot(*ends_m, color=_DOOR, linewidth=3.0, solid_capstyle="butt",
                                 linestyle=(0, (1.0, 1.0)) if opened else "-", label=label)
    return [keys[label] for label in sorted(keys)]


def _movers(axes: Axes, run: Run) -> list[Artist]:
    """Draw the paths of moving obstacles. A run's results do not have their true positions."""
    keys: list[Artist] = []
    for mover in run.scenario.environment.moving_obstacles:
        path_m = np.array(mover.path_m)
        line, = axes.plot(*path_m.T, "--", color=_MOVER, linewidth=1.2,
                          label="path of a moving obstacle")
        axes.add_patch(Circle(path_m[0], mover.radius_m, color=_MOVER))
        keys = [line]
    return keys


def _knowledge(axes: Axes, run: Run) -> None:
    cells = run.map.cells
    _raster(axes, run.map)
    wrong = (cells >= 0) & ((cells > 0) != (run.truth.cells > 0))
    axes.imshow(np.ma.masked_where(~wrong, wrong), cmap=ListedColormap([_WRONG]), vmin=0, vmax=1,
                origin="lower", extent=run.map.extent_m, interpolation="nearest")
    metrics = run.metrics
    axes.set_title(f"(b) Map of {metrics['judged_robot']} at the end, "
                   f"{metrics['map_completeness']:.2%} complete")
    _legend_below(axes, ncols=4, handles=[
        Patch(facecolor=_FREE, edgecolor="grey", label="free"),
        Patch(color=_SOLID, label="occupied"), Patch(color=_UNKNOWN, label="unknown"),
        Patch(color=_WRONG, label=f"wrong ({metrics['map_error_cells']} cells)")])


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
    reached_s = metrics.get("exploration_time_s")
    if reached_s is not None:
        axes.axvline(reached_s, color="grey", linewidth=0.8,
                     label=f"{EXPLORED:.0%} known to one robot, {reached_s:.1f} s")
    axes.set(title="(c) Explored share (thin: each robot)", xlabel="simulated time [s]",
             ylabel="share of the reachable area [%]", ylim=(0.0, 103.0),
             xlim=(0.0, max(metrics["simulated_s"], 1e-9)))
    axes.grid(alpha=0.3)
    _partitions(axes, run)
    _legend_below(axes, ncols=2)


def _partitions(axes: Axes, run: Run) -> None:
    """Shade the times when some robots could not reach each other, even over others."""
    found = run.metrics["partitions"]
    times = "once" if found["count"] == 1 else f"{found['count']} times"
    for i, (begin_s, end_s) in enumerate(found["episodes_s"]):
        axes.axvspan(begin_s, end_s, color=_APART, alpha=0.4, linewidth=0, zorder=0, label=None if i
                     else f"fleet split, {times}, {found['total_s']:.0f} s in all")


def _traffic(axes: Axes, run: Run) -> None:
    rates = {name.removeprefix(_PREFIX): measured(run.samples, name) for name in run.samples
             if name.startswith(_PREFIX)}
    most = {family: values.max() for family, (_, values) in rates.items()}
    for number, family in enumerate(sorted(most, key=lambda family: -most[family])):
        times_s, values = rates[family]
        # A row has the mean since the row before.
        axes.plot(times_s, 1e-3 * values, linewidth=1.3, drawstyle="steps-pre", label=family,
                  color=f"C{number % 10}", linestyle=_DASHES[number // 10 % len(_DASHES)])
    panel = "d" if len(run.robots["robot"]) else "b"
    axes.set(title=f"({panel}) Delivered between hosts, by topic (* is any robot)",
             xlabel="simulated time [s]", ylabel="contents [kB/s], 1 kB = 1000 bytes",
             xlim=(0.0, max(run.metrics["simulated_s"], 1e-9)))
    axes.grid(alpha=0.3)
    _partitions(axes, run)
    if any(value > 0.0 for value in most.values()):
        axes.set_yscale("symlog", linthresh=0.1)
        plain(axes.yaxis)
        axes.set_ylim(0.0, 3e-3 * max(most.values()))
        _legend_below(axes, ncols=3)
    else:
        axes.text(0.5, 0.5, "no messages between hosts", transform=axes.transAxes, ha="center")


def _raster(axes: Axes, drawn: OccupancyMap) -> None:
    shade = np.where(drawn.cells < 0, 0, np.where(drawn.cells > 0, 2, 1))
    # Mixed as colours, so that a wall of one cell does not fall between two pixels.
    axes.imshow(shade, cmap=ListedColormap([_UNKNOWN, _FREE, _SOLID]), vmin=0, vmax=2,
                origin="lower", extent=drawn.extent_m, interpolation="antialiased",
                interpolation_stage="rgba")
    axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")


def _legend_below(axes: Axes, ncols: int, handles: Sequence[Artist] | None = None) -> None:
    """Draw the legend below the axes, where it covers nothing."""
    axes.legend(handles=handles, ncols=ncols, loc="upper left", bbox_to_anchor=(0.0, -0.13),
                frameon=False, handlelength=1.6, columnspacing=1.2, borderaxespad=0.0)
