"""A picture of the map and the path that SLAM made of a log."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from desim.imports.slam_logs.slam_trial import SlamTrial
from desim.report.drawing import drawing
from desim.report.picture_file import save

_UNKNOWN = 205.0 / 255.0  # the grey of ROS's map_server
_MARGIN_M = 1.0
_MOST_CELLS = 2000  # along a side: more than pictures of 8 inches have points


@drawing({"font.size": 9, "axes.titlesize": 11})
def draw_slam(trial: SlamTrial, title: str, path: Path) -> None:
    """Write the map with the path over it; the file's ending says the format (png, pdf, svg)."""
    grid = trial.map
    low, top = _known(grid.occupancy.max(1))
    left, right = _known(grid.occupancy.max(0))
    known = _coarse(grid.occupancy[low:top, left:right]).astype(float)
    # Occupied from a quarter on, as gmapping publishes it.
    shades = np.where(known < 0.0, _UNKNOWN, 1.0 - np.minimum(known / 25.0, 1.0))
    x0, y0, cell_m = *grid.origin_m, grid.resolution_m
    height, width = shades.shape
    figure = Figure(figsize=(8.0, 1.0 + 8.0 * min(max(height / width, 0.3), 3.0)), dpi=160,
                    layout="constrained")
    axes = figure.subplots()
    axes.imshow(shades, cmap="gray", vmin=0.0, vmax=1.0, origin="lower", interpolation="nearest",
                extent=(x0 + left * cell_m, x0 + right * cell_m, y0 + low * cell_m,
                        y0 + top * cell_m))
    axes.plot(trial.path[:, 0], trial.path[:, 1], color="#d62728", linewidth=0.8)
    axes.set(xlabel="x in m", ylabel="y in m", aspect="equal", title=title)
    save(figure, path)


def _known(highest: np.ndarray) -> tuple[int, int]:
    """From where to where rows or columns have known cells, by the ``highest`` value of each; all,
    if no scan had a return."""
    at = np.flatnonzero(highest >= 0)
    return (int(at[0]), int(at[-1]) + 1) if len(at) else (0, len(highest))


def _coarse(occupancy: np.ndarray) -> np.ndarray:
    """Of each block of cells the highest: one occupied cell shows, and one known cell."""
    for axis, cells in enumerate(occupancy.shape):
        step = -(-cells // _MOST_CELLS)
        occupancy = np.maximum.reduceat(occupancy, np.arange(0, cells, step), axis)
    return occupancy
