"""A picture of a terrain: walls, what is solid, and doors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from desim.imports.terrains.found import FoundTerrain
from desim.report.picture_file import save


@rc_context({"text.parse_math": False, "font.size": 9, "axes.titlesize": 11})
def draw_terrain(found: FoundTerrain, title: str, path: Path) -> None:
    """Write the picture; the file's ending says the format (png, pdf, svg)."""
    terrain = found.terrain
    x0, y0, x1, y1 = terrain.bounds
    figure = Figure(figsize=(8.0, 1.0 + 8.0 * min(max((y1 - y0) / (x1 - x0), 0.3), 3.0)), dpi=160,
                    layout="constrained")
    axes = figure.subplots()
    corners = terrain.solids[:, [0, 1, 2, 1, 2, 3, 0, 3]].reshape(-1, 4, 2)
    axes.add_collection(PolyCollection(list(corners), facecolor="#c9ced6", edgecolor="#c9ced6",
                                       linewidth=0.2))
    axes.add_collection(LineCollection(list(terrain.walls.reshape(-1, 2, 2)), color="#1f2933",
                                       linewidth=1.0))
    doors = [np.array((door.start_m, door.end_m)) for door in found.doors]
    axes.add_collection(LineCollection(doors, color="#d9822b", linewidth=2.0))
    axes.set(xlim=(x0, x1), ylim=(y0, y1), xlabel="x in m", ylabel="y in m", aspect="equal",
             title=title)
    save(figure, path)
