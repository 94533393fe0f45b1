"""The growth of a robot's map: since when it knows what it knows."""

from __future__ import annotations

import numpy as np

from desim.compiler.kernel import compiled_function
from desim.engine.kernel import Kernel
from desim.monitor.kernels import note_known
from desim.ports import GridSpec
from desim.robot.robot_map import RobotMap
from desim.robot.tiles import OCCUPIED, TILE, raster
from desim.units import NS_PER_S

NEVER = 65535  # as an instant
TENTH_NS = NS_PER_S // 10
_MOST_CELLS = 1 << 25  # of all robots' maps: 64 MB
_MOST_HALVINGS = 5  # a place a tile
_note_known = compiled_function(note_known)


def halvings(grid: GridSpec, robots: int) -> int:
    """The number of times that the resolution of ``grid`` is halved for all maps to fit."""
    return next((count for count in range(_MOST_HALVINGS)
                 if robots * grid.width * grid.height >> 2 * count <= _MOST_CELLS),
                _MOST_HALVINGS)


def coarse(grid: GridSpec, halved: int) -> GridSpec:
    """``grid`` with squares of 2^halved cells a side for cells."""
    return GridSpec(grid.resolution_m * 2 ** halved, -(-grid.width >> halved),
                    -(-grid.height >> halved), grid.x_m, grid.y_m)


class MapGrowth:
    """The growth of one robot's map from the start of its software to its end.

    A cell is known from the first instant on at which the map was sure of it; whether it is
    ``occupied`` is what the map believed at the end.
    """

    def __init__(self, robot: str, robot_map: RobotMap, kernel: Kernel, halved: int) -> None:
        self.robot, self.started_ns, self.until_ns = robot, kernel.now_ns, kernel.now_ns
        self.grid = coarse(robot_map.spec, halved)
        self._map, self._kernel, self._halved = robot_map, kernel, halved
        self._since = np.full((len(robot_map.tiles), (TILE >> halved) ** 2), NEVER, np.uint16)
        robot_map.observers.append(self._learned)

    def _learned(self, robot_map: RobotMap, tiles: np.ndarray) -> None:
        since = (self._kernel.now_ns - self.started_ns) // TENTH_NS
        _note_known(robot_map.fused, tiles, self._halved, min(since, NEVER - 1), self._since)

    def take(self, now_ns: int) -> None:
        """Take ``known_since`` and ``occupied`` as of now; the last time when the robot's software
        ends."""
        self.until_ns = now_ns
        self.known_since = _raster(self.grid, self._map, self._since)
        fine = raster(self._map.spec, self._map.fused) >= OCCUPIED
        side, grid = 1 << self._halved, self.grid
        whole = np.zeros((grid.height * side, grid.width * side), bool)
        whole[:fine.shape[0], :fine.shape[1]] = fine
        self.occupied = whole.reshape(grid.height, side, grid.width, side).max(axis=(1, 3))


def _raster(grid: GridSpec, robot_map: RobotMap, places: np.ndarray) -> np.ndarray:
    """[height, width] of ``grid``, of ``places`` [tiles, places of a tile]."""
    up, across, side = robot_map.tiles_y, robot_map.tiles_x, int(places.shape[1] ** 0.5)
    whole = places.reshape(up, across, side, side).swapaxes(1, 2)
    return whole.reshape(up * side, across * side)[:grid.height, :grid.width].copy()
