"""The maps of all particles, in tiles that they share until one of them changes."""

from __future__ import annotations

import math

import numpy as np

from desim.robot.slam.kernels.tiles import (
    CELLS,
    SIDE,
    Maps,
    Stock,
    count_patches,
    register_all,
    resample,
    unroll,
)

_PATCH = 32 // SIDE  # tiles along a side of one of gmapping's patches
# Of a hash (Knuth, 6.4).
_WEIGHTS = np.multiply.accumulate(np.full(_PATCH * _PATCH, 0x9E3779B97F4A7C15, np.uint64))
_MARGIN = 4  # tiles around what is needed, when the table grows


class SharedMaps:
    """Grid maps of ``particles``, all empty at first. They grow as scans are added.

    ``arrays`` is what kernels read; it is another one after ``cover``, ``add`` and ``follow``.
    """

    def __init__(self, particles: int, resolution_m: float) -> None:
        self.arrays = Maps(
            visit_tiles=np.zeros((particles, 1), np.int32),
            hit_tiles=np.zeros((particles, 1), np.int32),
            visits=np.zeros((1, CELLS), np.int16), hits=np.zeros((1, CELLS), np.int16),
            means=np.zeros((1, CELLS, 4), np.float32), visit_stock=_stock(), hit_stock=_stock(),
            columns=1, left=0, low=0, resolution_m=resolution_m)

    def cover(self, left_m: float, low_m: float, right_m: float, high_m: float) -> None:
        """Make the tables reach over a rectangle."""
        maps = self.arrays
        size_m = maps.resolution_m * SIDE
        rows = maps.visit_tiles.shape[1] // maps.columns
        left, low = int(left_m // size_m) - 1, int(low_m // size_m) - 1
        right, high = int(right_m // size_m) + 2, int(high_m // size_m) + 2
        if (left >= maps.left and low >= maps.low and right <= maps.left + maps.columns
                and high <= maps.low + rows):
            return
        if maps.visit_tiles.any():
            left, low = min(left - _MARGIN, maps.left), min(low - _MARGIN, maps.low)
            right = max(right + _MARGIN, maps.left + maps.columns)
            high = max(high + _MARGIN, maps.low + rows)
        at = np.s_[:, maps.low - low:maps.low - low + rows,
                   maps.left - left:maps.left - left + maps.columns]
        tables = []
        for old in (maps.visit_tiles, maps.hit_tiles):
            table = np.zeros((len(old), high - low, right - left), np.int32)
            if maps.visit_tiles.any():
                table[at] = old.reshape(len(old), rows, maps.columns)
            tables.append(table.reshape(len(old), -1))
        self.arrays = maps._replace(visit_tiles=tables[0], hit_tiles=tables[1],
                                    columns=right - left, left=left, low=low)

    def add(self, poses: np.ndarray, mount: tuple[float, float], points: np.ndarray,
            lines: np.ndarray) -> None:
        """Add a scan to all maps, each seen from its particle's pose [particles, 3].

        ``mount``: the laser on the robot in m | ``points`` [n, 4]: returns and normals in the
        robot's frame | ``lines`` [m, 4]: those to which visits are counted.
        """
        x_m, y_m = points[:, 0], points[:, 1]
        reach_m = math.sqrt((x_m * x_m + y_m * y_m).max(initial=0.0)) + math.hypot(*mount)
        margin_m = reach_m + self.arrays.resolution_m
        self.cover(*(poses.min(0)[:2] - margin_m).tolist(), *(poses.max(0)[:2] + margin_m).tolist())
        side = int(2.0 * margin_m / (self.arrays.resolution_m * SIDE)) + 2
        visited, first = min(side * side, self.arrays.visit_tiles.shape[1]), 0
        while True:
            first = register_all(first, poses, *mount, points, len(points), lines, len(lines),
                                 visited, self.arrays)
            if first == len(poses):
                return
            self._provide(visited, len(points))

    def _provide(self, visited: int, returned: int) -> None:
        """Enlarge the pools so that so many tiles for visits, and for returns, are free: for all
        particles, as a pool that grows is copied, and tiles take memory only when written to."""
        maps = self.arrays
        particles = len(maps.visit_tiles)
        if maps.visit_stock.free_count[0] < visited:
            stock, capacity = _grown(maps.visit_stock, visited + particles * returned)
            self.arrays = maps = maps._replace(visit_stock=stock,
                                               visits=_longer(maps.visits, capacity))
        if maps.hit_stock.free_count[0] < returned:
            stock, capacity = _grown(maps.hit_stock, particles * returned)
            self.arrays = maps._replace(hit_stock=stock, hits=_longer(maps.hits, capacity),
                                        means=_longer(maps.means, capacity))

    def follow(self, ancestors: np.ndarray) -> None:
        """Give each particle the map of its ancestor ([particles from now on] int64)."""
        maps = self.arrays
        visit_tiles, hit_tiles = (np.empty((len(ancestors), maps.visit_tiles.shape[1]), np.int32)
                                  for _ in range(2))
        resample(ancestors, maps, visit_tiles, hit_tiles)
        self.arrays = maps._replace(visit_tiles=visit_tiles, hit_tiles=hit_tiles)

    def counts(self, particle: int) -> tuple[np.ndarray, np.ndarray, tuple[float, float]]:
        """A particle's visits and returns [rows, columns], and the place (m, m) of the corner of
        the first cell."""
        maps = self.arrays
        rows = maps.visit_tiles.shape[1] // maps.columns
        visits, hits = (np.zeros((rows * SIDE, maps.columns * SIDE), np.int16) for _ in range(2))
        unroll(particle, visits, hits, maps)
        size_m = maps.resolution_m * SIDE
        return visits, hits, (maps.left * size_m, maps.low * size_m)

    def patches(self) -> int:
        """The number of different patches of 32 x 32 cells in all maps, as gmapping would keep
        them: what two particles share counts once, where all of the patch is the same."""
        maps = self.arrays
        particles, tiles = maps.visit_tiles.shape
        across, up = (count // _PATCH + 2 for count in (maps.columns, tiles // maps.columns))
        hashes = np.zeros((particles, up, across), np.uint64)  # more than they can reach into
        # Of 64 bits: those of two patches are the same by chance once in 1e19 pairs.
        return count_patches(maps, _PATCH, _WEIGHTS, hashes)


def _stock() -> Stock:
    return Stock(np.zeros(1, np.int32), np.zeros(1, np.int32), np.zeros(1, np.int64))


def _grown(stock: Stock, wanted: int) -> tuple[Stock, int]:
    """A stock with at least ``wanted`` free tiles, and its capacity."""
    before, free = len(stock.refs), int(stock.free_count[0])
    capacity = max(2 * before, before + wanted)
    tiles = np.zeros(capacity, np.int32)
    # The tile that is taken next stands last: what is in use lies close together.
    fresh = capacity - before
    tiles[:fresh] = np.arange(capacity - 1, before - 1, -1)
    tiles[fresh:fresh + free] = stock.free[:free]
    return Stock(_longer(stock.refs, capacity), tiles, np.array([fresh + free])), capacity


def _longer(array: np.ndarray, capacity: int) -> np.ndarray:
    """A copy with zeros behind."""
    longer = np.zeros((capacity, *array.shape[1:]), array.dtype)
    longer[:len(array)] = array
    return longer
