"""Grids of evidence in shared tiles, and what a robot believes.

Evidence is log-odds in integers, so that sums are exact and their order does not matter. A layer is
the evidence of one source; a belief is the robot's own layer, the last that it received of every
other source's, and their sum. Tiles are 32 x 32 cells and copied only when somebody writes to one
that is shared: a layer on its way through the network costs a few hundred bytes.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from desim.middleware.messages import LaserScan, occupancy_grid_bytes
from desim.ports import GridSpec
from desim.robot.kernels import grids as kernels
from desim.robot.kernels.grids import CLAMP_HIGH, CLAMP_LOW, HIT, MISS

__all__ = ["CELLS", "CLAMP_HIGH", "CLAMP_LOW", "FREE", "HIT", "MISS", "OCCUPIED", "TILE", "Belief",
           "Layer", "LayerSnapshot", "TilePool", "fuse", "raster", "tiles_across", "tiles_of"]

TILE = 32
CELLS = TILE * TILE
FREE, OCCUPIED = int(kernels.FREE), int(kernels.OCCUPIED)  # the sum's thresholds


def tiles_across(spec: GridSpec) -> tuple[int, int]:
    """Columns and rows of tiles that cover the grid."""
    return -(-spec.width // TILE), -(-spec.height // TILE)


def raster(spec: GridSpec, tiles: np.ndarray) -> np.ndarray:
    """[height, width] cells, row 0 at the bottom, of ``tiles`` [tiles, 1024]."""
    across, up = tiles_across(spec)
    whole = tiles.reshape(up, across, TILE, TILE).swapaxes(1, 2).reshape(up * TILE, across * TILE)
    return np.ascontiguousarray(whole[:spec.height, :spec.width])


def tiles_of(spec: GridSpec, cells: np.ndarray) -> np.ndarray:
    """The inverse of ``raster``; cells beyond the grid are 0."""
    across, up = tiles_across(spec)
    whole = np.zeros((up * TILE, across * TILE), cells.dtype)
    whole[:spec.height, :spec.width] = cells
    return whole.reshape(up, TILE, across, TILE).swapaxes(1, 2).reshape(up * across, CELLS)


def cell_numbers(spec: GridSpec) -> np.ndarray:
    """uint32 [width + height]: a cell's number, tile * 1024 + place in the tile, is the sum of its
    column's entry and its row's."""
    columns, rows = np.arange(spec.width), np.arange(spec.height)
    of_column = columns // TILE * CELLS + columns % TILE
    of_row = rows // TILE * (tiles_across(spec)[0] * CELLS) + rows % TILE * TILE
    return np.concatenate((of_column, of_row)).astype(np.uint32)


class TilePool:
    """All tiles of a simulation: ``data`` [capacity, 1024] int8 and ``refs`` [capacity].

    Tile 0 is the empty one. Where a tile lies in the pool has no meaning for anything else.
    """

    def __init__(self, capacity: int = 1024) -> None:
        self.data = np.zeros((capacity, CELLS), np.int8)
        self.refs = np.zeros(capacity, np.int32)
        self.free = np.arange(capacity - 1, -1, -1, dtype=np.int32)
        self.free_count = np.array([capacity - 1])  # all but tile 0, which is last in ``free``

    @property
    def in_use(self) -> int:
        """Tiles that somebody points to."""
        return len(self.data) - 1 - int(self.free_count[0])

    def reserve(self, tiles: int) -> None:
        """Double the pool until ``tiles`` are free."""
        while self.free_count[0] < tiles:
            capacity, count = len(self.data), int(self.free_count[0])
            self.data = np.concatenate((self.data, np.zeros_like(self.data)))
            self.refs = np.concatenate((self.refs, np.zeros_like(self.refs)))
            free = np.zeros(2 * capacity, np.int32)
            free[:capacity] = np.arange(2 * capacity - 1, capacity - 1, -1)
            free[capacity:capacity + count] = self.free[:count]
            self.free = free
            self.free_count[0] = count + capacity


class LayerSnapshot:
    """A source's evidence as it was, immutable: pool ``indices`` [k] of the ``tiles`` [k].

    ``complete`` says that these are all tiles of the layer. The pool's tiles are held until the
    last reference to the snapshot goes.
    """

    __slots__ = ("pool", "tiles", "indices", "complete")

    def __init__(self, pool: TilePool, tiles: np.ndarray, indices: np.ndarray,
                 complete: bool) -> None:
        self.pool, self.tiles, self.indices, self.complete = pool, tiles, indices, complete
        kernels.hold_all(indices, pool.refs)

    def __del__(self, drop_all: Callable = kernels.drop_all,
                at_exit: Callable = sys.is_finalizing) -> None:
        if not at_exit():  # kernels cannot be called any more, and the memory goes anyway
            pool = self.pool
            drop_all(self.indices, pool.refs, pool.free, pool.free_count)

    def only(self, tiles: np.ndarray) -> LayerSnapshot:
        """Of a complete snapshot, these tiles."""
        return LayerSnapshot(self.pool, tiles, self.indices[tiles], False)

    def filled(self) -> np.ndarray:
        """The tile numbers that hold any evidence."""
        return self.tiles[self.indices != 0]

    def cells(self) -> np.ndarray:
        """[k, 1024] int8 log-odds, a copy."""
        return self.pool.data[self.indices]


class Layer:
    """The evidence of one source: int32 ``indices`` [tiles] into the pool, copied on write."""

    __slots__ = ("pool", "tiles", "indices", "_latest")

    def __init__(self, pool: TilePool, tiles: np.ndarray) -> None:
        self.pool, self.tiles = pool, tiles
        self.indices = np.zeros(len(tiles), np.int32)
        self._latest: LayerSnapshot | None = None

    def __del__(self, drop_all: Callable = kernels.drop_all,
                at_exit: Callable = sys.is_finalizing) -> None:
        if not at_exit():  # kernels cannot be called any more, and the memory goes anyway
            pool = self.pool
            drop_all(self.indices, pool.refs, pool.free, pool.free_count)

    def snapshot(self) -> LayerSnapshot:
        """The layer as it is now; the same object until the layer changes."""
        if self._latest is None:
            self._latest = LayerSnapshot(self.pool, self.tiles, self.indices.copy(), True)
        return self._latest

    def changing(self) -> None:
        """To be called before the layer is written to: let go of the snapshot kept for the next
        asker, so that its tiles need no copy unless somebody else holds it."""
        self._latest = None

    def changed_since(self, before: LayerSnapshot) -> np.ndarray:
        """Tile numbers written to since the complete snapshot ``before`` was taken (as long as it
        is held, its tiles stay its own)."""
        return self.tiles[self.indices != before.indices]


class ReceivedLayer(Layer):
    """What was received of another source: ``sent`` [tiles] has the version that each tile was
    sent with, -1 for none, ``newest`` the newest of them."""

    __slots__ = ("sent", "newest")

    def __init__(self, pool: TilePool, tiles: np.ndarray) -> None:
        super().__init__(pool, tiles)
        self.sent = np.full(len(tiles), -1)
        self.newest = -1

    def receiving(self, version: int, snapshot: LayerSnapshot) -> None:
        """To be called before tiles are replaced. After the newest complete snapshot the layer is
        that snapshot, which then serves everybody."""
        self._latest = snapshot if snapshot.complete and version > self.newest else None
        self.newest = max(self.newest, version)


class _Room:
    """Arrays that one sweep at a time works in, shared by all maps of one raster."""

    __slots__ = ("numbers", "marks", "cells", "_stamp")

    def __init__(self, spec: GridSpec) -> None:
        count = math.prod(tiles_across(spec)) * CELLS
        self.numbers = cell_numbers(spec)
        self.marks = np.zeros(count, np.uint8)
        self.cells = np.empty(count + 1, np.uint32)
        self._stamp = 0

    def stamp(self) -> int:
        """A number that no cell is marked with."""
        self._stamp = self._stamp % 255 + 1
        if self._stamp == 1:
            self.marks[:] = 0
        return self._stamp


_room = lru_cache(maxsize=4)(_Room)


class Belief:
    """What one robot knows: ``fused`` int16 [tiles, 1024], the sum of all its layers, always up to
    date. A sum of int16 holds 468 sources at the clamp.

    ``version`` counts the changes of what is known: cells that became free, occupied or unknown.
    More evidence for what they are already is none. ``tile_version`` [tiles] has the version of
    each tile's last one. ``observers`` are called as ``observer(belief, changed_tiles)`` after it.
    """

    __slots__ = ("spec", "pool", "tiles_x", "tiles_y", "tiles", "size_bytes", "fused", "version",
                 "tile_version", "observers", "own", "received", "_changed", "_room")

    def __init__(self, spec: GridSpec, pool: TilePool) -> None:
        self.spec, self.pool = spec, pool
        self.tiles_x, self.tiles_y = tiles_across(spec)
        self.tiles = np.arange(self.tiles_x * self.tiles_y, dtype=np.int32)
        self.size_bytes = occupancy_grid_bytes(spec.width * spec.height)
        self.fused = np.zeros((len(self.tiles), CELLS), np.int16)
        self.version = 0
        self.tile_version = np.zeros(len(self.tiles), np.int64)
        self.observers: list[Callable[[Belief, np.ndarray], None]] = []
        self.own = Layer(pool, self.tiles)
        self.received: dict[str, ReceivedLayer] = {}
        self._changed = np.empty(len(self.tiles), np.int32)
        self._room = _room(spec)

    def integrate_scan(self, x_m: float, y_m: float, yaw_rad: float, scan: LaserScan,
                       usable_range_m: float) -> None:
        """Take a scan seen from this pose into the own layer and the sum. Beams of
        ``usable_range_m`` and more clear space up to there and mark nothing."""
        pool, spec, room = self.pool, self.spec, self._room
        pool.reserve(len(self.tiles))
        self.own.changing()
        per_m = 1.0 / spec.resolution_m
        no_return = float(np.float32(scan.range_max_m)) * per_m
        hits, stop = kernels.sweep(
            (x_m - spec.x_m) * per_m, (y_m - spec.y_m) * per_m, yaw_rad, scan.ranges,
            scan.angle_min_rad, scan.angle_increment_rad, per_m, no_return, usable_range_m * per_m,
            spec.width, spec.height, room.numbers, room.stamp(), room.marks, room.cells)
        count = 0
        for cells, amount in (room.cells[:hits], HIT), (room.cells[hits:stop], MISS):
            count = kernels.add_evidence(
                cells, amount, self.version + 1, count, self.own.indices, pool.data, pool.refs,
                pool.free, pool.free_count, self.fused, self.tile_version, self._changed)
        self._note(count)

    def receive(self, source: str, version: int, snapshot: LayerSnapshot) -> bool:
        """Take in ``source``'s evidence as of ``version``: each tile of ``snapshot`` replaces what
        is there if it is newer. The newest of each tile wins, so order, duplicates and gaps do not
        matter. True if what is known changed."""
        layer = self.received.get(source)
        if layer is None:
            layer = self.received[source] = ReceivedLayer(self.pool, self.tiles)
        layer.receiving(version, snapshot)
        pool = self.pool
        count = kernels.replace(
            version, snapshot.tiles, snapshot.indices, self.version + 1, layer.indices,
            layer.sent, pool.data, pool.refs, pool.free, pool.free_count, self.fused,
            self.tile_version, self._changed)
        self._note(count)
        return count > 0

    def layers(self) -> tuple[LayerSnapshot, ...]:
        """Snapshots of all layers, own first: the belief as it is now, immutable."""
        return (self.own.snapshot(), *(layer.snapshot() for layer in self.received.values()))

    def _note(self, count: int) -> None:
        if count:
            self.version += 1
            if self.observers:
                changed = self._changed[:count].copy()
                for observer in self.observers:
                    observer(self, changed)


def fuse(layers: tuple[LayerSnapshot, ...]) -> np.ndarray:
    """int16 [tiles, 1024]: the sum of complete snapshots, from scratch."""
    total = np.zeros((len(layers[0].tiles), CELLS), np.int16)
    for layer in layers:
        total += layer.cells()
    return total
