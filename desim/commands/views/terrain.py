"""The facts of a terrain that was read from a file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypedDict

import numpy as np

from desim.imports.terrains.found import FoundTerrain
from desim.imports.terrains.written import between_walls
from desim.scenario.file_kinds import FileKind
from desim.scenario.schema.environment import Shape

_CELL_M = 0.1  # in which free ground is counted, unless the terrain has cells of its own
_SMALL_M2 = 1.0  # free ground of less than this is no part that a robot would be in
_AT_THE_EDGE = "free cells lie at the edge"  # in a note of a picture that is open there
_WALLED = 0.1  # of free ground that has walls on all sides: less is outside of a building
_RIM_CELLS = 2  # from the edge of the terrain, whose outermost cells are solid


class Facts(TypedDict):
    """Size, walls and free ground of a terrain, in m and m2: walls and solid blocks as the file has
    them, of cells the edges. ``outside_m2``: of free ground around a building whose inside no way
    connects with it. ``free_parts``: the number of other parts that no way connects;
    ``free_parts_m2``: of the ten largest, the largest first."""

    format: str
    width_m: float
    depth_m: float
    from_m: list[float]
    walls: int
    walls_m: float
    blocks: int | None
    doors: int
    free_m2: float
    outside_m2: float
    free_parts: int
    free_parts_m2: list[float]
    notes: list[str]


def facts(kind: FileKind, found: FoundTerrain) -> Facts:
    """The facts of a terrain that was found in a file of a kind."""
    terrain = found.terrain
    x0, y0, x1, y1 = terrain.bounds
    cell_m = _CELL_M if terrain.raster is None else terrain.raster.resolution_m
    free = terrain.truth(terrain.grid(cell_m)) == 0
    plan = found.source if isinstance(found.source, Shape) else None
    walls = terrain.walls if plan is None else np.array(
        [wall.start_m + wall.end_m for wall in plan.walls]).reshape(-1, 4)
    has_rim = plan is not None or any(_AT_THE_EDGE in note for note in found.notes)
    outside_m2, parts_m2 = _parts_m2(free, cell_m, has_rim)
    lengths_m = np.hypot(*(walls[:, 2:] - walls[:, :2]).T)
    return {"format": kind.name, "width_m": round(x1 - x0, 3), "depth_m": round(y1 - y0, 3),
            "from_m": [round(x0, 3), round(y0, 3)], "walls": len(walls),
            "walls_m": round(float(lengths_m.sum()), 1),
            "blocks": None if plan is None else len(plan.polygons), "doors": len(found.doors),
            "free_m2": round(float(free.sum()) * cell_m ** 2, 1), "outside_m2": outside_m2,
            "free_parts": len(parts_m2), "free_parts_m2": parts_m2[:10],
            "notes": list(found.notes)}


def text(file: Path, known: Facts, files: Sequence[Path]) -> str:
    """The facts in lines, and the files that were written."""
    parts, parts_m2 = known["free_parts"], known["free_parts_m2"]
    outside = f", {known['outside_m2']:g} m2 of it outside" if known["outside_m2"] else ""
    apart = (f", {'inside ' if outside else ''}in {parts} parts that no way connects: "
             f"{', '.join(f'{part:g}' for part in parts_m2)}{', ...' * (parts > len(parts_m2))} m2"
             if parts > 1 else "")
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
        f"  free   {known['free_m2']:g} m2{outside}{apart}",
        *(f"note: {note}" for note in known["notes"]),
        *(f"written: {path}" for path in files)])


def _parts_m2(free: np.ndarray, cell_m: float, has_rim: bool) -> tuple[float, list[float]]:
    """The area outside of the building, 0 if nothing is apart from it, and the areas of the other
    parts of free ground, the largest first. ``has_rim``: there is free ground at the edges of the
    terrain. Outside is what reaches three of them and lies hardly anywhere between walls."""
    from scipy.ndimage import label

    joined, _ = label(free)
    areas = np.bincount(joined.ravel()) * cell_m ** 2
    sides = np.zeros(len(areas), int)
    for side in (joined[:_RIM_CELLS], joined[-_RIM_CELLS:], joined[:, :_RIM_CELLS],
                 joined[:, -_RIM_CELLS:]):
        sides[np.unique(side)] += 1
    large = areas >= _SMALL_M2
    large[0] = False  # what is solid
    within = np.bincount(joined.ravel(), between_walls(~free).ravel()) * cell_m ** 2
    outside = large & (sides >= 3) & (within < _WALLED * areas) & has_rim
    if not (large & ~outside).any():
        outside[:] = False
    return (round(float(areas[outside].sum()), 1),
            [round(float(area), 1) for area in np.sort(areas[large & ~outside])[::-1]])
