"""Maps in the format of ROS map_server: a YAML file beside a PGM or PNG image.

Trinary mode (map_server's default): with p = (255 - value) / 255, or value / 255 if ``negate``,
a cell is occupied above ``occupied_thresh``, free below ``free_thresh`` and unknown in between.
Unknown cells are solid here: nothing has ever been seen in them. In a colour image the mean of
the channels counts, without transparency.

``materials`` is a key of ours, which ROS ignores: the material of occupied (and unknown) cells by
grey value. All greys that count as occupied look alike to a laser, there as here.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import AbstractContextManager
from io import BufferedReader
from pathlib import Path, PurePosixPath
from typing import NamedTuple

import numpy as np

from desim import outside_yaml
from desim.errors import InputError, did_you_mean
from desim.files import content, opened, opened_below
from desim.ports import materials
from desim.scenario.schema.environment import MapFile
from desim.world.terrain import MAX_CELLS, Raster, Terrain, from_raster

IMAGES = (".pgm", ".png", ".pnm", ".bmp", ".jpg", ".jpeg", ".tif", ".tiff")
_FORMATS = ("PPM", "PNG", "BMP", "JPEG", "TIFF")  # Pillow reads others by other programs
_MOST_BYTES, _MOST_IMAGE_BYTES = 10_000_000, 400_000_000  # of the YAML file, of its image
MATERIALS = "materials"
KEYS = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh", "mode",
        MATERIALS)


class _Image(NamedTuple):
    """An image: ``cells`` [rows, cols], top row first, of greys by number; ``values`` of all
    greys, 0 to 255."""

    path: Path
    cells: np.ndarray
    values: np.ndarray


def load(map_file: MapFile, other: int) -> Terrain:
    """The terrain of a map_server YAML; its material is ``other`` where the file names none.

    Raises ``InputError`` for anything wrong with either file.
    """
    path = Path(map_file.map)
    facts = _facts(path)
    if map_file.image is None:  # named by the map: not outside of its folder
        name = PurePosixPath(str(facts["image"])).as_posix()
        image = _read(path, path.parent / name, opened_below(path.parent, name, _MOST_IMAGE_BYTES))
    else:
        image = _read(path, file := path.parent / map_file.image, opened(file, _MOST_IMAGE_BYTES))
    occupied, free = _number(path, facts, "occupied_thresh"), _number(path, facts, "free_thresh")
    if not 0.0 <= free < occupied <= 1.0:
        raise InputError(f"{path}: free_thresh must lie below occupied_thresh and both between 0 "
                         f"and 1, got free_thresh {free:g} and occupied_thresh {occupied:g}")
    negate = _number(path, facts, "negate")
    if negate not in (0.0, 1.0):
        raise InputError(f"{path}: negate must be 0 or 1, got {facts['negate']!r}")
    p = image.values / 255.0 if negate else (255.0 - image.values) / 255.0
    is_free = ((p < free) & ~(p > occupied))[image.cells]
    if not is_free.any():
        raise InputError(f"{image.path}: no free cell (free means p < {free:g}; see free_thresh "
                         f"and negate in {path.name})")
    resolution = _number(path, facts, "resolution")
    if not 0.0 < resolution < np.inf:
        raise InputError(f"{path}: resolution must be above zero, got {facts['resolution']!r}")
    x_m, y_m = _origin(path, facts)
    material = _material(path, image, facts, other, is_free, p > occupied)
    raster, material = _cropped(is_free[::-1], material[::-1], resolution,
                                x_m + map_file.offset_m[0], y_m + map_file.offset_m[1])
    return from_raster(path.stem, raster, material, map_file.height_m)


def _material(path: Path, image: _Image, facts: dict[str, object], other: int,
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
    for key in KEYS[:6]:
        if key not in facts:
            near = did_you_mean(key, [str(k) for k in facts if k not in KEYS])
            raise InputError(f"{path}: {key!r} is missing{near}")
    if facts.get("mode", "trinary") != "trinary":
        raise InputError(f"{path}: mode {facts['mode']!r} is not supported; allowed: trinary")
    return facts


def _read(map_path: Path, path: Path, opening: AbstractContextManager[BufferedReader]) -> _Image:
    from PIL import Image, UnidentifiedImageError

    try:
        with opening as file, Image.open(file, formats=_FORMATS) as image:
            if image.width * image.height > MAX_CELLS:
                raise InputError(f"{path}: {image.width} x {image.height} pixels are too many "
                                 f"(allowed: {MAX_CELLS})")
            sixteen_bits = image.mode.startswith("I")
            pixels = np.asarray(image if sixteen_bits or image.mode == "L"
                                else image.convert("RGB"))
    except FileNotFoundError:
        beside = map_path.parent.iterdir()
        there = sorted(file.name for file in beside if file.suffix.lower() in IMAGES)
        raise InputError(f"{map_path}: its image {path.name!r} does not exist; images beside it: "
                         f"{', '.join(there) or 'none'}; `image:` in the scenario's terrain "
                         "overrides the one that the YAML names") from None
    except UnidentifiedImageError:
        raise InputError(f"{path}: cannot be read as an image: cannot identify image file "
                         f"{str(path)!r}") from None
    except (OSError, SyntaxError, ValueError,
            Image.DecompressionBombError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot be read as an image: {reason}") from None
    if pixels.size == 0:
        raise InputError(f"{path}: the image is empty")
    if pixels.ndim == 3:  # the mean of the channels
        return _Image(path, pixels.sum(axis=2, dtype=np.uint16), np.arange(3 * 255 + 1) / 3.0)
    if sixteen_bits:
        return _Image(path, pixels.clip(0, 65535).astype(np.uint16), np.arange(65536) / 257.0)
    return _Image(path, pixels, np.arange(256.0))


def _number(path: Path, facts: dict[str, object], key: str) -> float:
    try:
        return _float(facts[key])
    except (TypeError, ValueError):
        raise InputError(f"{path}: {key} must be a number, got {facts[key]!r}") from None


def _float(value: object) -> float:
    if not isinstance(value, int | float | str):
        raise TypeError
    return float(value)


def _origin(path: Path, facts: dict[str, object]) -> tuple[float, float]:
    origin = facts["origin"]
    try:
        x_m, y_m, yaw_rad = map(_float, origin if isinstance(origin, Iterable) else ())
    except (TypeError, ValueError):
        raise InputError(f"{path}: origin must be [x, y, yaw], got {facts['origin']!r}") from None
    if not (np.isfinite(x_m) and np.isfinite(y_m)):
        raise InputError(f"{path}: origin must be finite, got {facts['origin']!r}")
    if yaw_rad != 0.0:
        raise InputError(f"{path}: origin has a yaw of {yaw_rad:g} rad; only maps that are not "
                         "rotated (yaw 0) are supported")
    return x_m, y_m


def _cropped(free: np.ndarray, material: np.ndarray, resolution_m: float, x_m: float, y_m: float
             ) -> tuple[Raster, np.ndarray]:
    """The part with free cells in it, with a solid border of one cell, and its material [rows,
    cols]. A border outside of the image is of the material beside it."""
    rows, cols = np.flatnonzero(free.any(axis=1)), np.flatnonzero(free.any(axis=0))
    part = slice(rows[0], rows[-1] + 3), slice(cols[0], cols[-1] + 3)  # of one with a border
    solid = np.ascontiguousarray(np.pad(~free, 1, constant_values=True)[part])
    return (Raster(solid, resolution_m, x_m + (int(cols[0]) - 1) * resolution_m,
                   y_m + (int(rows[0]) - 1) * resolution_m),
            np.pad(material, 1, mode="edge")[part])
