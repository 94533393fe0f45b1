"""Maps as ROS map_server keeps them: a PGM image and a YAML file beside it."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml

from desim.ports import GridSpec

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
        "free_thresh": 0.196}, sort_keys=False))


def load(folder: Path, name: str) -> OccupancyMap:
    """Read what ``save`` wrote."""
    about = yaml.safe_load((folder / f"{name}.yaml").read_text())
    magic, size, depth, pixels = (folder / about["image"]).read_bytes().split(b"\n", 3)
    if (magic, depth) != (b"P5", b"255"):
        raise ValueError(f"{folder / about['image']} was not written by desim")
    width, height = map(int, size.split())
    image = np.frombuffer(pixels, np.uint8).reshape(height, width)[::-1]
    cells = np.full(image.shape, -1, np.int8)
    cells[image == _FREE] = 0
    cells[image == _OCCUPIED] = 100
    x_m, y_m, _ = about["origin"]
    return OccupancyMap(cells, GridSpec(about["resolution"], width, height, x_m, y_m))
