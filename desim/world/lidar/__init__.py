"""The laser scanners of the fleet: all of one kind, cast by one kernel call."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from desim.errors import InputError
from desim.scenario.robot import Laser
from desim.world.index import tile_index
from desim.world.lidar import kernels
from desim.world.terrain import Raster, Terrain

TILE_M = 8.0  # a road of the paper; smaller tiles list fewer walls and cost memory


class Field(NamedTuple):
    """How far the nearest solid cell is: ``near`` [rows, cols] uint8 chessboard distance in cells,
    at most 255 | ``frame`` x0 m, y0 m, cells per m. No raster: no cells."""

    near: np.ndarray
    frame: np.ndarray


def field(raster: Raster | None) -> Field:
    """The field of a raster terrain."""
    if raster is None:
        return Field(np.zeros((0, 0), dtype=np.uint8), np.array([0.0, 0.0, 1.0]))
    from scipy.ndimage import distance_transform_cdt

    near = distance_transform_cdt(~raster.solid, metric="chessboard").clip(0, 255)
    return Field(np.ascontiguousarray(near, dtype=np.uint8),
                 np.array([raster.x_m, raster.y_m, 1.0 / raster.resolution_m]))


class Lidar:
    """Casts sweeps. Beam i points to ``angle_min_rad + i * increment_rad`` from the heading."""

    def __init__(self, laser: Laser, terrain: Terrain, free: Field, radii_m: np.ndarray,
                 keys: np.ndarray) -> None:
        if not 0.0 < laser.field_of_view_rad <= 2.0 * np.pi + 1e-9:
            raise InputError("robot.laser.field_of_view: must be above 0 and at most 360 deg, got "
                             f"{np.degrees(laser.field_of_view_rad):g} deg")
        if laser.max_range_m <= 0.0:
            raise InputError("robot.laser.max_range: must be above zero")
        self.beams = laser.beams
        self.angle_min_rad = -laser.field_of_view_rad / 2.0
        self.increment_rad = laser.field_of_view_rad / (laser.beams - 1)
        angles = self.angle_min_rad + self.increment_rad * np.arange(laser.beams)
        tiles = tile_index(terrain.lines, terrain.bounds, TILE_M, laser.max_range_m)
        self._fixed = (np.stack([np.cos(angles), np.sin(angles)]), *tiles, *free)
        self._radii_m = radii_m
        self._laser = np.array([self.angle_min_rad, self.increment_rad, laser.max_range_m,
                                laser.noise_m, float(len(terrain.lines))])
        self._keys = keys
        self._inverse = np.empty(laser.beams)

    def scan(self, poses: np.ndarray, walls: np.ndarray, discs: np.ndarray, robots: np.ndarray,
             tick: int) -> np.ndarray:
        """[len(robots), beams] float32 m, among ``walls`` [n, 4] (the terrain's, then closed
        doors') and ``discs`` [d, 3]."""
        out = np.empty((len(robots), self.beams), dtype=np.float32)
        kernels.scan(poses, robots, tick, self._radii_m, walls, *self._fixed, discs, self._laser,
                     self._keys, self._inverse, out)
        return out
