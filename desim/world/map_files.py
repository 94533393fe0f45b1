"""Maps in the format of ROS map_server: a YAML file beside a PGM or PNG image.

With p = (255 - value) / 255, or value / 255 if ``negate``, a cell is occupied above
``occupied_thresh``, else free below ``free_thresh``, in this order, as nav2_map_server's map_io.cpp
has it. What lies in between is unknown in the mode ``trinary`` (the default), and a probability in
``scale``; ``raw`` has probabilities of 0 to 100 % as pixels. Here unknown cells are solid, as
nothing has ever been seen in them, and a probability counts as what is nearer. In a colour image
the mean of the channels counts, without transparency.

``materials`` is a key of ours, which ROS ignores: the material of occupied (and unknown) cells by
grey value. All greys that count as occupied look alike to a laser, there as here.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from contextlib import AbstractContextManager
from dataclasses import replace
from io import BufferedReader
from pathlib import Path
from typing import NamedTuple

import numpy as np

from desim import outside_yaml
from desim.errors import InputError, did_you_mean
from desim.files import content, near, opened, opened_below
from desim.ports import materials
from desim.scenario import file_kinds
from desim.scenario.schema.environment import MapFile
from desim.world import map_images
from desim.world.map_images import MOST_BYTES, MapImage
from desim.world.terrain import Terrain, of_free_cells

IMAGES = (".pgm", ".png", ".pnm", ".bmp", ".jpg", ".jpeg", ".tif", ".tiff")
_MOST_BYTES = 10_000_000  # of the YAML file
MATERIALS = "materials"
_UNKNOWN = 205  # the grey of unknown ground, as map savers of ROS write it
KEYS = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh", "mode",
        MATERIALS)


def load(map_file: MapFile, other: int) -> Terrain:
    """The terrain of a map_server YAML; its material is ``other`` where the file names none.

    Raises ``InputError`` for anything wrong with either file.
    """
    # Installed by links, as colcon does, the map and its image are side by side at their origin.
    path = Path(os.path.realpath(map_file.map))
    facts = _facts(path)
    if map_file.image is None:  # named by the map: in its folder, or the one above
        folder, name = near(path.parent, str(facts["image"]))
        image = _read(path, folder / name, opened_below(folder, name, MOST_BYTES))
    else:
        image = _read(path, file := path.parent / map_file.image, opened(file, MOST_BYTES))
    is_free, is_occupied = _states(path, facts, image.values)
    free = is_free[image.cells]
    if not free.any():
        raise InputError(f"{image.path}: no free cell (see free_thresh, negate and mode in "
                         f"{path.name})")
    resolution = _number(path, facts, "resolution")
    if not 0.0 < resolution < np.inf:
        raise InputError(f"{path}: resolution must be above zero, got {facts['resolution']!r}")
    x_m, y_m, yaw_rad = _origin(path, facts)
    material = _material(path, image, facts, other, free, is_occupied)
    free, material, corner = _turned(free[::-1], material[::-1], yaw_rad)
    terrain = of_free_cells(path, free, material, resolution,
                            (x_m + map_file.offset_m[0] + corner[0] * resolution,
                             y_m + map_file.offset_m[1] + corner[1] * resolution),
                            map_file.height_m)
    return replace(terrain, doubts=_doubts(path, image, facts["image"], is_free))


class _States(NamedTuple):
    """By grey number, [n] bool: whether such cells are free, and whether they are occupied."""

    free: np.ndarray
    occupied: np.ndarray


def _states(path: Path, facts: dict[str, object], values: np.ndarray) -> _States:
    """The states of greys ``values`` [n], 0 to 255. Raises ``InputError``."""
    occupied, free = (_share(path, facts, key) for key in ("occupied_thresh", "free_thresh"))
    negate = _number(path, facts, "negate")
    if negate not in (0.0, 1.0):
        raise InputError(f"{path}: negate must be 0 or 1, got {facts['negate']!r}")
    mode = str(facts.get("mode", "trinary")).lower()
    if mode == "raw":
        is_known = values <= 100.0
        return _States(is_known & (values < 50.0), is_known & (values >= 50.0))
    p = values / 255.0 if negate else (255.0 - values) / 255.0
    if mode == "trinary":
        return _States((p < free) & ~(p > occupied), p > occupied)
    if mode == "scale":
        middle = (free + occupied) / 2
        return _States((p < max(free, middle)) & ~(p > occupied), (p > occupied) | (p >= middle))
    raise InputError(f"{path}: unknown mode {facts['mode']!r}; allowed: trinary, scale, raw")


def _doubts(path: Path, image: MapImage, named: object, is_free: np.ndarray) -> tuple[str, ...]:
    """Sentences on what is likely to be wrong with a map that can be read."""
    doubts = []
    if os.path.isabs(str(named)):
        doubts.append(f"{path}: its image {named} is taken from its own folder")
    free = is_free[image.cells]
    grey = np.flatnonzero(np.rint(image.values) == _UNKNOWN)
    unknown = int(np.isin(image.cells, grey[is_free[grey]]).sum())
    if unknown:
        doubts.append(f"{path}: {unknown} of {int(free.sum())} free cells have the grey value "
                      f"{_UNKNOWN}, which map savers write for unknown ground; mode trinary with "
                      "free_thresh 0.196 leaves them unknown")
    return (*doubts, *(f"{path}: {doubt}" for doubt in map_images.open_edge(image.path, free)))


def _turned(free: np.ndarray, material: np.ndarray, yaw_rad: float,
            ) -> tuple[np.ndarray, np.ndarray, tuple[float, float]]:
    """Cells [rows, cols], row 0 lowest, turned anticlockwise around the corner of cell (0, 0), in
    cells of the same size that take the state of the nearest one; and where the corner of the new
    cell (0, 0) lies, in cells. Outside of the image nothing is free."""
    if yaw_rad == 0.0:
        return free, material, (0.0, 0.0)
    rows, cols = free.shape
    cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
    corners = np.array([(0, 0), (cols, 0), (0, rows), (cols, rows)])
    x, y = corners @ (cos, -sin), corners @ (sin, cos)
    low_x, low_y = math.floor(x.min()), math.floor(y.min())
    new_x = low_x + np.arange(math.ceil(x.max()) - low_x) + 0.5
    new_y = low_y + np.arange(math.ceil(y.max()) - low_y)[:, None] + 0.5
    col = np.floor(new_x * cos + new_y * sin).astype(int)
    row = np.floor(new_y * cos - new_x * sin).astype(int)
    inside = (col >= 0) & (col < cols) & (row >= 0) & (row < rows)
    at = row.clip(0, rows - 1), col.clip(0, cols - 1)
    return free[at] & inside, material[at], (low_x, low_y)


def _material(path: Path, image: MapImage, facts: dict[str, object], other: int,
              is_free: np.ndarray, is_occupied: np.ndarray) -> np.ndarray:
    """[rows, cols] the material of each cell, rows of ``materials.NAMES``. Free cells are given by
    cell, occupied greys by number."""
    legend = facts.get(MATERIALS)
    material = np.full(image.cells.shape, other, np.int8)
    if legend is None:
        return material
    if not isinstance(legend, dict) or not all(type(grey) is int for grey in legend):
        raise InputError(f"{path}: {MATERIALS} must name a material by grey value, as in "
                         f"{{0: concrete, 40: glass}}, got {legend!r}")
    greys = np.rint(image.values)
    for grey, name in sorted(legend.items()):
        here = (greys == grey)[image.cells]
        if (here & is_free).any():
            raise InputError(f"{path}: {MATERIALS}.{grey}: {image.path.name} has free cells of "
                             "this grey value; only what is occupied or unknown has a material")
        material[here] = materials.index(name, f"{path}: {MATERIALS}.{grey}")
    rows, cols = np.nonzero((is_occupied & ~np.isin(greys, list(legend)))[image.cells])
    if len(rows):
        raise InputError(f"{image.path}: occupied cells of grey value "
                         f"{greys[image.cells[rows[0], cols[0]]]:g} "
                         f"(row {rows[0] + 1}, column {cols[0] + 1}; {len(rows)} cells in all) "
                         f"have no material; {MATERIALS} of {path.name} has "
                         f"{', '.join(map(str, sorted(legend)))} (an image drawn with smooth edges "
                         "has more grey values than it shows)")
    return material


def _facts(path: Path) -> dict[str, object]:
    import yaml

    try:
        facts = outside_yaml.read(content(path, _MOST_BYTES).decode("utf-8"))
    except FileNotFoundError:
        there = sorted(file.name for file in path.parent.glob("*.y*ml")) or ["none"]
        raise InputError(f"{path}: no such map; YAML files beside it: {', '.join(there)}") from None
    except (OSError, ValueError, yaml.YAMLError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"{path}: cannot be read as YAML: {reason}") from None
    if not isinstance(facts, dict):
        raise InputError(f"{path}: not a map_server file; its keys are {', '.join(KEYS)}")
    if "image" not in facts and (advice := file_kinds.advice(path)):
        raise InputError(f"{path}: no map_server file; {advice}")
    for key in KEYS[:6]:
        if key not in facts:
            near = did_you_mean(key, [str(k) for k in facts if k not in KEYS])
            raise InputError(f"{path}: {key!r} is missing{near}")
    return facts


def _read(map_path: Path, path: Path, opening: AbstractContextManager[BufferedReader]) -> MapImage:
    try:
        with map_images.opened(path, opening) as image:
            return map_images.greys(path, image)
    except FileNotFoundError:
        beside = map_path.parent.iterdir()
        there = sorted(file.name for file in beside if file.suffix.lower() in IMAGES)
        raise InputError(f"{map_path}: its image {path.name!r} does not exist; images beside it: "
                         f"{', '.join(there) or 'none'}; `image:` in the scenario's terrain "
                         "overrides the one that the YAML names") from None


def _number(path: Path, facts: dict[str, object], key: str) -> float:
    try:
        return _float(facts[key])
    except (TypeError, ValueError):
        raise InputError(f"{path}: {key} must be a number, got {facts[key]!r}") from None


def _float(value: object) -> float:
    if not isinstance(value, int | float | str):
        raise TypeError
    return float(value)


def _share(path: Path, facts: dict[str, object], key: str) -> float:
    share = _number(path, facts, key)
    if not 0.0 <= share <= 1.0:
        raise InputError(f"{path}: {key} must lie between 0 and 1, got {facts[key]!r}")
    return share


def _origin(path: Path, facts: dict[str, object]) -> tuple[float, float, float]:
    """x and y in m, and the yaw in rad, for which some map savers write NaN: they mean 0."""
    origin = facts["origin"]
    try:
        x_m, y_m, yaw_rad = map(_float, origin if isinstance(origin, Iterable) else ())
    except (TypeError, ValueError):
        raise InputError(f"{path}: origin must be [x, y, yaw], got {facts['origin']!r}") from None
    if not np.isfinite([x_m, y_m]).all() or np.isinf(yaw_rad):
        raise InputError(f"{path}: origin must be finite, got {facts['origin']!r}")
    return x_m, y_m, 0.0 if np.isnan(yaw_rad) else yaw_rad
