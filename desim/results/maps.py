"""Maps as ROS map_server keeps them: a PGM image and a YAML file beside it."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml

from desim.ports import GridSpec
from desim.scenario import yaml12

# map_saver: free 254, occupied 0, unknown 205; thresholds 0.65 and 0.196.
_FREE, _OCCUPIED, _UNKNOWN = 254, 0, 205


class OccupancyMap(NamedTuple):
    """An occupancy grid: ``cells`` int8 [height, width], row 0 at the lowest y; 0 is free, 100
    occupied, -1 unknown."""

    cells: np.ndarray
    grid: GridSpec

    @property
    def extent_m(self) -> tuple[float, float, float, float]:
        """Left, right, bottom, top."""
        grid = self.grid
        return (grid.x_m, grid.x_m + grid.width * grid.resolution_m,
                grid.y_m, grid.y_m + grid.height * grid.resolution_m)


def save(folder: Path, name: str, cells: np.ndarray, grid: GridSpec) -> None:
    """Write ``name.pgm`` and ``name.yaml``."""
    image = np.full(cells.shape, _UNKNOWN, np.uint8)
    image[cells == 0] = _FREE
    image[cells > 0] = _OCCUPIED
    header = f"P5\n{grid.width} {grid.height}\n255\n".encode()
    (folder / f"{name}.pgm").write_bytes(header + image[::-1].tobytes())
    (folder / f"{name}.yaml").write_text(yaml.safe_dump({
        "image": f"{name}.pgm", "resolution": grid.resolution_m,
        "origin": [grid.x_m, grid.y_m, 0.0], "negate": 0, "occupied_thresh": 0.65,
        "free_thresh": 0.196}, sort_keys=False), "utf-8")


def parsed(about: bytes, image: bytes) -> OccupancyMap:
    """The map of what ``save`` wrote: the YAML file, and the image. Raises ``ValueError`` or
    ``LookupError``."""
    facts = yaml12.parse(about.decode(), "the map's YAML file")[0]
    magic, size, depth, pixels = image.split(b"\n", 3)
    if (magic, depth) != (b"P5", b"255"):
        raise ValueError("was not written by desim")
    width, height = map(int, size.split())
    shades = np.frombuffer(pixels, np.uint8).reshape(height, width)[::-1]
    cells = np.full(shades.shape, -1, np.int8)
    cells[shades == _FREE] = 0
    cells[shades == _OCCUPIED] = 100
    resolution_m, x_m, y_m = map(float, (facts["resolution"], *facts["origin"][:2]))
    return OccupancyMap(cells, GridSpec(resolution_m, width, height, x_m, y_m))
