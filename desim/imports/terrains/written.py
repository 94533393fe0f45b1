"""Writes a terrain: as a scenario that stands on it, or as a map of ROS."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from desim.errors import InputError
from desim.files import target
from desim.imports.terrains.found import NEAREST_M, FoundTerrain, Point, Start
from desim.imports.terrains.found import written as written_point
from desim.ports import Params
from desim.scenario import yaml12
from desim.scenario.schema.environment import MapFile, Shape
from desim.scenario.source_places import Data
from desim.units import ANGLE
from desim.world.terrain import Terrain

_CELL_M = 0.1  # in which free ground is searched, unless the terrain has cells of its own
_APART_M = 1.5
_MAP_CELL_M = 0.05  # as map savers of ROS have it
_MOST_PARTS = 5000  # walls and blocks, which a scenario has room for
_TEXT = """\
# The terrain is that of {origin}; see docs/maps.md.
{name}{environment}\
# At {places}. More robots: raise size, and name a pose for each of them, or take
# start: {{from: [x, y], step: [dx, dy]}}. Other types: docs/robots.md.
{fleet}\
# What to change next: the network, as in
# network: {{media: {{lan: {{model: switch, rate: 1 Mb/s}}}}}}
# (a workstation simulates the lasers and sends scans over it; robots with lasers, computers and a
# radio of their own: deployment: field)
# the cells of the robots' maps (0.2 m by default), for small robots as in
# robot: {{mapping: {{resolution: 0.05 m}}}}
# the strategy (desim plugins lists all), as in
# coordination: {{strategy: minpos}}
# and the end, as in
# stop: {{explored: 99 %, elapsed: 30 min}}
"""
_FREE, _OCCUPIED = 254, 0  # greys, as map savers of ROS write them


def write_scenario(found: FoundTerrain, origin: str, path: Path, robots: str = "pioneer3dx"
                   ) -> list[Path]:
    """Write a scenario whose terrain this is, ``origin`` in a comment; a raster, or a plan of very
    many walls, as a map beside it. Returns the files. Raises ``InputError``."""
    written, source = [path], found.source
    poses = [_pose(start) for start in found.starts or starts(found.terrain)]
    if source is None or (isinstance(source, Shape)
                          and len(source.walls) + len(source.polygons) > _MOST_PARTS):
        image = path.with_name(f"{path.stem}.map.pgm")
        written += write_map(found.terrain, image)
        source = MapFile(map=image.with_suffix(".yaml").name)
    elif isinstance(source, MapFile):
        source = source.model_copy(update={"map": os.path.relpath(source.map, path.parent)})
    environment: Data = {"terrain": _given(source)}
    if found.doors:
        environment["doors"] = [_given(door) for door in found.doors]
    with target(path, "--to") as beside:
        beside.write_text(_TEXT.format(
            origin=origin, places=("the robots' poses there" if found.starts else
                                   "places far from walls"), name=yaml12.dump({"name": path.stem}),
            environment=yaml12.dump({"environment": environment}),
            fleet=yaml12.dump({"fleet": {"size": len(poses), "robots": robots,
                                         "start": {"poses": poses}}})), "utf-8")
    return written


def _pose(place: Start | Point) -> Data:
    pose: Data = dict(zip("xy", written_point(place[:2]), strict=True))
    if isinstance(place, Start):
        pose["heading"] = ANGLE.format(round(place.heading_rad, 6))
    return pose


def _given(block: Params) -> Data:
    """The keys of a block that were given, as a scenario has them."""
    return block.model_dump(mode="json", by_alias=True, exclude_unset=True)


def starts(terrain: Terrain) -> list[Point]:
    """Two places, or one where there is no more, in the largest part of free ground, each as far
    from walls as can be: between walls on all four sides, if there are such places."""
    from scipy.ndimage import distance_transform_edt, label

    grid = terrain.grid(_CELL_M if terrain.raster is None else terrain.raster.resolution_m)
    parts, _ = label(terrain.truth(grid) == 0)
    enclosed = (parts > 0) & between_walls(parts == 0)
    count = np.bincount(parts[enclosed if enclosed.any() else parts > 0])
    largest = parts == count.argmax()
    if enclosed.any():
        largest &= enclosed
    clear_m = distance_transform_edt(np.pad(largest, 1))[1:-1, 1:-1] * grid.resolution_m
    places: list[Point] = []
    rows, cols = map(np.arange, clear_m.shape)
    while len(places) < 2 and clear_m.max() > NEAREST_M:
        row, col = np.unravel_index(clear_m.argmax(), clear_m.shape)
        places.append((grid.x_m + (col + 0.5) * grid.resolution_m,
                       grid.y_m + (row + 0.5) * grid.resolution_m))
        clear_m[np.hypot(rows[:, None] - row, cols - col) * grid.resolution_m < _APART_M] = 0.0
    if not places:
        raise InputError(f"--to: no place of {terrain.name!r} is {NEAREST_M:g} m from all walls; "
                         "is its scale right?")
    return places


def between_walls(solid: np.ndarray) -> np.ndarray:
    """[rows, cols] bool: the cells with something solid on all four sides, apart from the rim."""
    inner = np.pad(solid[1:-1, 1:-1], 1)
    found = np.ones_like(solid)
    for axis in (0, 1):
        found &= np.maximum.accumulate(inner, axis)
        found &= np.flip(np.maximum.accumulate(np.flip(inner, axis), axis), axis)
    return found


def write_map(terrain: Terrain, image: Path, resolution_m: float | None = None) -> list[Path]:
    """Write a map of ROS, a raster in its own cells: the image, and its YAML file beside it.
    Returns both. Raises ``InputError``."""
    edge_m = resolution_m or _MAP_CELL_M if terrain.raster is None else terrain.raster.resolution_m
    grid = terrain.grid(edge_m)
    pixels = np.where(terrain.truth(grid)[::-1] == 0, _FREE, _OCCUPIED).astype(np.uint8)
    facts = image.with_suffix(".yaml")
    with target(image, "--to") as beside:
        beside.write_bytes(b"P5\n%d %d\n255\n" % (grid.width, grid.height) + pixels.tobytes())
    with target(facts, "--to") as beside:
        beside.write_text(yaml12.dump({
            "image": image.name, "mode": "trinary", "resolution": edge_m,
            "origin": [round(grid.x_m, 9), round(grid.y_m, 9), 0.0], "negate": 0,
            "occupied_thresh": 0.65, "free_thresh": 0.196}), "utf-8")
    return [image, facts]


def check_target(path: Path) -> None:
    """Raise ``InputError`` for an ending that is neither a scenario's nor a map's."""
    if path.suffix not in (".yaml", ".yml", ".pgm"):
        raise InputError(f"--to: {path} ends neither like a scenario nor like a map; allowed: "
                         ".yaml (a scenario), .pgm (a map of ROS, with a .yaml beside it)")
