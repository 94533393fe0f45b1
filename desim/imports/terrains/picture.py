"""Bare images as ground: maps of ROS without their YAML file, and floor plans.

An image in the three greys of map savers is read as map_server reads it by default
(``free_thresh`` 0.196). In any other one a pixel is a wall if it is nearer to black than to white.
Row 0 of the ground is the lowest, its corner is the origin.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from desim.errors import InputError
from desim.files import opened
from desim.imports.terrains.found import Choices, FoundTerrain, material_of
from desim.scenario import file_kinds
from desim.world import map_images
from desim.world.terrain import of_free_cells

HEIGHT_M, MATERIAL = 2.0, "concrete"  # as a scenario's maps have them
_SAVED = (0, 205, 254, 255)  # the greys of map savers; 205 is unknown ground
_UNCLEAR = (255 * (1 - 0.65), 255 * (1 - 0.196))  # between map_server's default thresholds


def read(path: Path, choices: Choices) -> FoundTerrain:
    """The ground in an image whose pixels are ``choices.resolution_m`` wide. Raises
    ``InputError``."""
    notes = []
    facts = path.with_suffix(".yaml")
    if facts.is_file() and file_kinds.kind_of(facts) == file_kinds.MAP_SERVER:
        notes.append(f"{facts.name} beside it is a map of ROS, with a resolution and an origin")
    if choices.resolution_m is None:
        raise InputError("; ".join([f"{path}: an image does not say how wide its pixels are; give "
                                    "it in m, as in --resolution 0.05", *notes]))
    values, cells = _greys(path)
    share = np.bincount(cells.ravel(), minlength=len(values)) / cells.size
    saved = np.isin(np.rint(values), _SAVED)
    if share[saved].sum() > 0.99 and share[np.rint(values) == _SAVED[1]].sum() > 0.0:
        is_free = values > _UNCLEAR[1]
        notes.append("its greys are those of map savers: 205 is unknown ground, which is solid")
    else:
        is_free = values > 255 / 2
        if share[is_free].sum() < 0.5 and not is_free[cells[[0, -1]]].any():
            notes.append("most of it is dark; bright walls on dark ground have to be inverted")
        unclear = share[(values > _UNCLEAR[0]) & (values < _UNCLEAR[1])].sum()
        notes.append("dark pixels are walls, all others are free"
                     + (f"; {unclear:.1%} of them are neither dark nor bright" if unclear > 0.0005
                        else ""))
    free = is_free[cells]
    if free.all() or not free.any():
        raise InputError(f"{path}: all of its pixels are {'bright' if free.all() else 'dark'}; "
                         "walls have to be dark on bright ground")
    terrain = of_free_cells(path, free[::-1], material_of(choices, MATERIAL),
                            choices.resolution_m, (0.0, 0.0), choices.height_m or HEIGHT_M)
    return FoundTerrain(terrain, None, notes=(*notes, *map_images.open_edge(path, free)))


def _greys(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Values of all greys, and the number of each pixel's, on white paper where the image is
    transparent."""
    with map_images.opened(path, opened(path, map_images.MOST_BYTES)) as image:
        shown: Image.Image = image
        if "A" in image.getbands() or "transparency" in image.info:
            paper = Image.new("RGBA", image.size, "white")
            shown = Image.alpha_composite(paper, image.convert("RGBA"))
        _, cells, values = map_images.greys(path, shown)
        return values, cells
