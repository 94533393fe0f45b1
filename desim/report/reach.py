"""A picture of a medium's reach in a terrain.

It shows the reach from one place to all others, and between the hosts where they start.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from desim.errors import InputError, did_you_mean
from desim.network.medium import Medium
from desim.ports import GridSpec, PredictsSignal
from desim.ports.tasks import Ground
from desim.report.drawing import drawing
from desim.report.picture_file import save
from desim.scenario.schema.scenario import Scenario
from desim.simulation.simulation import Simulation
from desim.units import POSITION

SHARE = 0.9  # of packets: the line that is drawn around a place
WEAK_DBM = -110.0  # below all noise: no shades are spent on it
MOST_POINTS = 250_000  # of more cells, only every second one is drawn, or fewer
_WALL = ListedColormap(["#2b2f36"])


@drawing({"font.size": 9, "axes.titlesize": 11})
def draw(scenario: Scenario, at: str | None, medium: str | None, path: Path) -> str:
    """Write the picture to ``path``; its ending says the format (png, pdf, svg).

    ``at``: a host's name or ``x m, y m`` (default: the first host that has a place) | ``medium``:
    its name (default: the first). Returns the result in a line. Raises ``InputError`` for a place
    or a medium that is not there, or whose model does not predict signals.
    """
    simulation = Simulation(scenario)
    chosen, model = _medium(simulation, medium)
    places = chosen.positions(0)
    names = [host.name for host in simulation.graph.hosts]
    label, place = _place(at, names, places)
    figure = Figure(figsize=(13, 6.2), dpi=160, layout="constrained")
    one, all_ = figure.subplots(1, 2)
    ground = simulation.monitor.truth.ground
    share = _around(one, model, ground, place)
    one.set_title(f"(a) Received from {label}; white: {SHARE:.0%} of packets get through")
    linked, pairs = _between(all_, model, ground, names, places)
    all_.set_title(f"(b) Start of the fleet: {linked} of {pairs} links at {SHARE:.0%} or better")
    figure.suptitle(f"{scenario.name}: medium {chosen.name}, nobody else on the air", fontsize=13)
    save(figure, path)
    return (f"{share:.1%} of the reachable area gets {SHARE:.0%} of packets from {label}; "
            f"{linked} of {pairs} links between hosts at the start do")


def _medium(simulation: Simulation, name: str | None) -> tuple[Medium, PredictsSignal]:
    media = {medium.name: medium for medium in simulation.graph.media}
    if name is not None and name not in media:
        raise InputError(f"--medium: no medium {name!r}{did_you_mean(name, media)}; known: "
                         f"{', '.join(media)}")
    medium = media[name or next(iter(media))]
    if not isinstance(medium.model, PredictsSignal):
        choice = simulation.scenario.network.media[medium.name]
        rung = getattr(choice.params, "fidelity", None)
        words = f"{choice.model}, fidelity {rung}," if rung else choice.model
        if getattr(choice.params, "access_points", None):
            words = f"{choice.model} with access_points"
        raise InputError(f"network.media.{medium.name}.model: {words} does not say what comes in "
                         "where; coverage is for models that do, as radio with fidelity disk, "
                         "walls or mac and without access_points")
    return medium, medium.model


def _place(at: str | None, names: list[str], places: np.ndarray) -> tuple[str, np.ndarray]:
    placed = [name for name, place in zip(names, places, strict=True) if np.isfinite(place).all()]
    if at is None and placed:
        at = placed[0]
    if at in placed:
        return at, places[names.index(at)]
    try:
        x_m, y_m = map(POSITION.parse, (at or "").split(","))
    except ValueError:
        known = f"; hosts that have a place: {', '.join(placed)}" if placed else ""
        raise InputError(f"--at: {at!r} is no place{did_you_mean(at or '', placed)}; allowed: "
                         f"a host's name, or as '3 m, -2.5 m'{known}") from None
    return f"({x_m:g}, {y_m:g}) m", np.array([x_m, y_m])


def _around(axes: Axes, model: PredictsSignal, ground: Ground, place: np.ndarray) -> float:
    """Draw the reach of one place; returns the share of the reachable area that it covers."""
    grid = ground.grid
    step = max(1, int(np.ceil(np.sqrt(grid.width * grid.height / MOST_POINTS))))
    x_m = grid.x_m + (np.arange(0, grid.width, step) + 0.5) * grid.resolution_m
    y_m = grid.y_m + (np.arange(0, grid.height, step) + 0.5) * grid.resolution_m
    points = np.stack(np.meshgrid(x_m, y_m), axis=-1)
    power_dbm, delivery = (values.reshape(points.shape[:2])
                           for values in model.signal(place, points.reshape(-1, 2)))
    shown = axes.imshow(power_dbm, origin="lower", extent=_extent(grid), cmap="viridis",
                        vmin=max(float(power_dbm.min()), WEAK_DBM))
    axes.figure.colorbar(shown, ax=axes, label="received power [dBm]", shrink=0.8)
    if delivery.min() < SHARE <= delivery.max():
        axes.contour(x_m, y_m, delivery, [SHARE], colors="white", linewidths=1.4)
    _walls(axes, ground)
    axes.plot(*place, "o", color="red", markeredgecolor="white", markersize=6)
    enough = delivery[ground.reachable[::step, ::step]] >= SHARE
    return float(enough.mean()) if enough.size else 0.0


def _between(axes: Axes, model: PredictsSignal, ground: Ground, names: list[str],
             places: np.ndarray) -> tuple[int, int]:
    """Draw the links; returns the number of pairs that reach each other well, and of all."""
    placed = np.flatnonzero(np.isfinite(places).all(axis=1))
    one, other = np.triu_indices(len(placed), 1)
    delivery = np.zeros(len(one))
    for k in range(len(placed)):
        own = one == k
        delivery[own] = model.signal(places[placed[k]], places[placed[other[own]]])[1]
    lines = np.stack([places[placed[one]], places[placed[other]]], axis=1)
    order = np.argsort(delivery)  # the best on top
    links = LineCollection(list(lines[order]), array=delivery[order], cmap="RdYlGn",
                           clim=(0.0, 1.0), linewidths=0.3 + 1.2 * delivery[order])
    axes.add_collection(links)
    axes.figure.colorbar(links, ax=axes, label="share of full packets that get through once",
                         shrink=0.8)
    _walls(axes, ground)
    axes.plot(*places[placed].T, "o", color="black", markersize=3.5)
    if len(placed) <= 12:
        for k in placed.tolist():
            axes.annotate(names[k], places[k], xytext=(4, 4), textcoords="offset points")
    return int((delivery >= SHARE).sum()), len(one)


def _walls(axes: Axes, ground: Ground) -> None:
    extent = _extent(ground.grid)
    axes.imshow(np.ma.masked_equal(ground.solid, 0), origin="lower", extent=extent, cmap=_WALL,
                vmin=0, vmax=1, interpolation="nearest")
    axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", xlim=extent[:2], ylim=extent[2:])


def _extent(grid: GridSpec) -> tuple[float, float, float, float]:
    x0_m, y0_m, x1_m, y1_m = grid.bounds()
    return x0_m, x1_m, y0_m, y1_m
