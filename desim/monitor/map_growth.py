"""The growth of a robot's map: since when it knows what it knows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from desim.compiler.kernel import compiled_function
from desim.engine.kernel import Kernel
from desim.monitor.kernels import note_known
from desim.ports import GridSpec
from desim.robot.mapping.robot_map import RobotMap
from desim.robot.mapping.tiles import OCCUPIED, TILE, raster
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


class Life(NamedTuple):
    """The time of one start of a robot's software with a map; ``until_ns`` None: it goes on."""

    robot: str
    started_ns: int
    until_ns: int | None


class MapGrowth(NamedTuple):
    """The growth of one robot's map from a start of its software to its end, or until now where
    it goes on (``Life`` says which). ``known_since`` uint16
    [height, width] of ``grid``, row 0 at the bottom: the tenths of a second from the start to the
    first instant at which the map was sure of the cell, ``NEVER`` if it never was; ``occupied``
    bool alike, as believed at the end."""

    robot: str
    started_ns: int
    until_ns: int
    grid: GridSpec
    known_since: np.ndarray
    occupied: np.ndarray


class GrowingMap:
    """Watches one robot's map from the start of its software on."""

    def __init__(self, robot: str, robot_map: RobotMap, kernel: Kernel, halved: int) -> None:
        self._robot, self._started_ns = robot, kernel.now_ns
        self._map, self._kernel, self._halved = robot_map, kernel, halved
        self._since = np.full((len(robot_map.tiles), (TILE >> halved) ** 2), NEVER, np.uint16)
        robot_map.observers.append(self._learned)

    def _learned(self, tiles: np.ndarray) -> None:
        since = (self._kernel.now_ns - self._started_ns) // TENTH_NS
        robot_map = self._map
        _note_known(robot_map.fused, robot_map.tile_version, robot_map.row_version, tiles,
                    self._halved, min(since, NEVER - 1), self._since)

    def growth(self) -> MapGrowth:
        """The growth until now."""
        grid = coarse(self._map.spec, self._halved)
        fine = raster(self._map.spec, self._map.fused) >= OCCUPIED
        side = 1 << self._halved
        whole = np.zeros((grid.height * side, grid.width * side), bool)
        whole[:fine.shape[0], :fine.shape[1]] = fine
        return MapGrowth(
            self._robot, self._started_ns, self._kernel.now_ns, grid,
            _raster(grid, self._map, self._since),
            whole.reshape(grid.height, side, grid.width, side).max(axis=(1, 3)))


def _raster(grid: GridSpec, robot_map: RobotMap, places: np.ndarray) -> np.ndarray:
    """[height, width] of ``grid``, of ``places`` [tiles, places of a tile]."""
    up, across, side = robot_map.tiles_y, robot_map.tiles_x, int(places.shape[1] ** 0.5)
    whole = places.reshape(up, across, side, side).swapaxes(1, 2)
    return whole.reshape(up * side, across * side)[:grid.height, :grid.width].copy()
