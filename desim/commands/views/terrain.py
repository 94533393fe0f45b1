"""The facts of a terrain that was read from a file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypedDict

import numpy as np

from desim.imports.terrains.found import FoundTerrain
from desim.scenario.file_kinds import FileKind
from desim.scenario.schema.environment import Shape

_CELL_M = 0.1  # in which free ground is counted, unless the terrain has cells of its own
_SMALL_M2 = 1.0  # free ground of less than this is no part that a robot would be in


class Facts(TypedDict):
    """Size, walls and free ground of a terrain, in m and m2: walls and solid blocks as the file has
    them, of cells the edges. ``free_parts_m2``: of the parts that no way connects, the largest
    first, at most ten."""

    format: str
    width_m: float
    depth_m: float
    from_m: list[float]
    walls: int
    walls_m: float
    blocks: int | None
    doors: int
    free_m2: float
    free_parts_m2: list[float]
    notes: list[str]


def facts(kind: FileKind, found: FoundTerrain) -> Facts:
    """The facts of a terrain that was found in a file of a kind."""
    terrain = found.terrain
    x0, y0, x1, y1 = terrain.bounds
    cell_m = _CELL_M if terrain.raster is None else terrain.raster.resolution_m
    free = terrain.truth(terrain.grid(cell_m)) == 0
    parts_m2 = _parts_m2(free, cell_m)
    plan = found.source if isinstance(found.source, Shape) else None
    walls = terrain.walls if plan is None else np.array(
        [wall.start_m + wall.end_m for wall in plan.walls]).reshape(-1, 4)
    lengths_m = np.hypot(*(walls[:, 2:] - walls[:, :2]).T)
    return {"format": kind.name, "width_m": round(x1 - x0, 3), "depth_m": round(y1 - y0, 3),
            "from_m": [round(x0, 3), round(y0, 3)], "walls": len(walls),
            "walls_m": round(float(lengths_m.sum()), 1),
            "blocks": None if plan is None else len(plan.polygons), "doors": len(found.doors),
            "free_m2": round(float(free.sum()) * cell_m ** 2, 1), "free_parts_m2": parts_m2[:10],
            "notes": list(found.notes)}


def text(file: Path, known: Facts, files: Sequence[Path]) -> str:
    """The facts in lines, and the files that were written."""
    parts_m2 = known["free_parts_m2"]
    apart = (f", in {len(parts_m2)} parts that no way connects: "
             f"{', '.join(f'{part:g}' for part in parts_m2)} m2" if len(parts_m2) > 1 else "")
    edges = "edges" if known["blocks"] is None else "walls"
    walls = [f"  {edges}  {known['walls']}, {known['walls_m']:g} m in all"] * (known["walls"] > 0)
    blocks = [f"  blocks {known['blocks']}"] if known["blocks"] else []
    doors = [f"  doors  {known['doors']}, which stand open"] if known["doors"] else []
    x_m, y_m = known["from_m"]
    return "\n".join([
        f"{file.name}: {known['format']}",
        f"  size   {known['width_m']:g} m x {known['depth_m']:g} m, from x = {x_m:g} m, "
        f"y = {y_m:g} m",
        *walls, *blocks, *doors,
        f"  free   {known['free_m2']:g} m2{apart}",
        *(f"note: {note}" for note in known["notes"]),
        *(f"written: {path}" for path in files)])


def _parts_m2(free: np.ndarray, cell_m: float) -> list[float]:
    """The areas of the parts of free ground, the largest first."""
    from scipy.ndimage import label

    joined, _ = label(free)
    areas = np.sort(np.bincount(joined.ravel())[1:])[::-1] * cell_m ** 2
    return [round(float(area), 1) for area in areas if area >= _SMALL_M2]
