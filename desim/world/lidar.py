"""Laser scanners: all those of one kind in a fleet, cast by one kernel call."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from desim.compiler.kernel import compiled_function
from desim.ports.kernels import cos, sin
from desim.scenario.schema.robot import Laser
from desim.world import people
from desim.world.kernels import lidar as kernels
from desim.world.outlines import Outlines
from desim.world.scene import Scene
from desim.world.terrain import Raster, Terrain
from desim.world.wall_index import tile_index

TILE_M = 8.0  # a road of the paper; smaller tiles list fewer walls and cost memory


class Lidar:
    """Casts sweeps of a kind of laser, ``height_m`` above the ground, among ``terrain``, doors that
    are ``doors_m`` [d] high, and robots of these ``radii_m`` [n] and ``outlines``, which reach from
    the first to the second height of ``extents_m`` [n, 2]. Beam i points to
    ``angle_min_rad + i * increment_rad`` from the laser's own heading.
    """

    def __init__(self, laser: Laser, height_m: float, terrain: Terrain, doors_m: np.ndarray,
                 radii_m: np.ndarray, outlines: Outlines, extents_m: np.ndarray, keys: np.ndarray
                 ) -> None:
        self.beams, self._height_m = laser.beams, height_m
        self._sees_people = height_m < people.HEIGHT_M
        self.angle_min_rad = -laser.field_of_view_rad / 2.0
        self.increment_rad = laser.increment_rad
        angles = [self.angle_min_rad + self.increment_rad * i for i in range(laser.beams)]
        met = terrain.above(height_m)
        self._lines = met.lines
        self._all = met is terrain and bool((doors_m > height_m).all())
        terrain = met
        tiles = tile_index(terrain.lines, terrain.bounds, TILE_M, laser.max_range_m)
        # Who is lower, higher or a polygon has no disc: no beam meets an infinite one from inside.
        level = (extents_m[:, 0] <= height_m) & (height_m <= extents_m[:, 1])
        radii_m = np.where(level & outlines.is_disc, radii_m, np.inf)
        self._outlines = outlines
        self._seen = np.repeat(level, np.diff(outlines.first))  # [sides of outlines] bool
        self._sees_outlines = bool(self._seen.any())
        directions = np.array([[cos(a) for a in angles], [sin(a) for a in angles]])
        self._arrays = kernels.LaserArrays(
            self.angle_min_rad, self.increment_rad, laser.max_range_m, laser.noise_m, laser.x_m,
            laser.y_m, laser.yaw_rad, directions, keys, np.empty(laser.beams), radii_m,
            len(terrain.lines), tiles, *_squares(terrain.raster))
        self._scan = compiled_function(kernels.scan)

    def scan(self, poses: np.ndarray, scene: Scene, robots: np.ndarray, tick: int) -> np.ndarray:
        """[len(robots), beams] float32 m, among what there is in ``scene``."""
        walls = scene.walls
        if not self._all:
            doors, doors_m = walls[scene.fixed:], scene.tops_m[scene.fixed:]
            walls = np.concatenate([self._lines, doors[doors_m > self._height_m]])
        discs = scene.discs if self._sees_people else scene.discs[:scene.movers]
        out = np.empty((len(robots), self.beams), dtype=np.float32)
        if not self._sees_outlines:
            self._scan(self._arrays, poses, robots, tick, walls, discs, out)
            return out
        # A polygon's sides are walls to all but the robot itself.
        sides, first = self._outlines.sides(poses), self._outlines.first
        for k, robot in enumerate(robots.tolist()):
            others = self._seen.copy()
            others[first[robot]:first[robot + 1]] = False
            self._scan(self._arrays, poses, robots[k:k + 1], tick,
                       np.concatenate([walls, sides[others]]), discs, out[k:k + 1])
        return out


@lru_cache(maxsize=4)  # the lasers of a robot are among the same cells
def _squares(raster: Raster | None) -> tuple[np.ndarray, np.ndarray]:
    """The free squares of a raster, and its frame: x0 m, y0 m, cells per m. No raster: no cells."""
    if raster is None:
        return np.zeros((4, 0, 0), dtype=np.uint8), np.array([0.0, 0.0, 1.0])
    squares = np.zeros((4, *raster.solid.shape), dtype=np.uint8)
    kernels.free_squares(raster.solid, squares)
    return squares, np.array([raster.x_m, raster.y_m, 1.0 / raster.resolution_m])
