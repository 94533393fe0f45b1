"""Maps drawn with characters: '.' free, '#' occupied, anything else unknown; top row first."""

from __future__ import annotations

import numpy as np

from desim.ports import GridSpec
from desim.robot.mapping.tiles import FREE, OCCUPIED, tiles_across, tiles_of
from desim.robot.navigation.global_costmap import GlobalCostmap

VALUES = {".": FREE, "#": OCCUPIED}


class Drawn:
    """As much of a ``RobotMap`` as navigation reads. ``cells`` [height, width] log-odds, row 0 at
    the bottom; its lower left corner is the origin."""

    def __init__(self, cells: np.ndarray, resolution_m: float = 0.2) -> None:
        height, width = cells.shape
        self.spec = GridSpec(resolution_m, width, height, 0.0, 0.0)
        self.tiles_x, self.tiles_y = tiles_across(self.spec)
        self.fused = np.zeros((self.tiles_x * self.tiles_y, 1024), np.int16)
        self.version = 0
        self.tile_version = np.zeros(len(self.fused), np.int64)
        self.row_version = np.zeros((len(self.fused), 32), np.int32)
        self.know(cells)

    def know(self, cells: np.ndarray) -> None:
        """From now on these are the cells."""
        fused = tiles_of(self.spec, cells.astype(np.int16))
        changed = (fused != self.fused).any(axis=1)
        if changed.any():
            self.version += 1
            self.fused[:] = fused
            self.tile_version[changed] = self.row_version[changed] = self.version


def cells(lines: list[str]) -> np.ndarray:
    return np.array([[VALUES.get(c, 0) for c in line] for line in reversed(lines)], np.int16)


def drawn(*lines: str, resolution_m: float = 0.2) -> Drawn:
    return Drawn(cells(list(lines)), resolution_m)


def costmap(robot_map: Drawn, radius_m: float = 0.26) -> GlobalCostmap:
    """With the defaults of costmap_2d, up to date."""
    made = GlobalCostmap(robot_map, radius_m, 0.55, 10.0)
    made.update()
    return made
