"""Grids of evidence in shared tiles, and a robot's belief of the world.

Evidence is log-odds in integers, so that sums are exact and their order does not matter. A layer is
the evidence of one source; a belief is the robot's own layer, the last that it received of every
other source's, and their sum. Tiles are 32 x 32 cells and copied at the first write to a shared
one: a layer on its way through the network costs a few hundred bytes.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from desim.middleware.contents import LaserScan
from desim.ports import GridSpec
from desim.robot.kernels import evidence
from desim.robot.kernels import tiles as kernels
from desim.robot.kernels.evidence import CLAMP_HIGH, CLAMP_LOW
from desim.robot.kernels.tiles import HIT, MISS

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
    """All tiles of a simulation (``arrays``). A tile's place in the pool has no meaning."""

    def __init__(self, capacity: int = 1024) -> None:
        self.arrays = kernels.Pool(
            np.zeros((capacity, CELLS), np.int8), np.zeros(capacity, np.int32),
            np.arange(capacity - 1, -1, -1, dtype=np.int32),
            np.array([capacity - 1]))  # free are all but tile 0, which is last in the list

    @property
    def in_use(self) -> int:
        """The number of tiles that some layer or snapshot points to."""
        return len(self.arrays.data) - 1 - int(self.arrays.free_count[0])

    def reserve(self, tiles: int) -> None:
        """Double the pool until ``tiles`` are free."""
        while self.arrays.free_count[0] < tiles:
            data, refs, free, free_count = self.arrays
            capacity, count = len(data), int(free_count[0])
            fresh = np.arange(2 * capacity - 1, capacity - 1, -1, dtype=np.int32)
            rest = np.zeros(capacity - count, np.int32)
            self.arrays = kernels.Pool(np.concatenate((data, np.zeros_like(data))),
                                       np.concatenate((refs, np.zeros_like(refs))),
                                       np.concatenate((fresh, free[:count], rest)),
                                       np.array([count + capacity]))


class LayerSnapshot:
    """A source's evidence at an instant, immutable: pool ``indices`` [k] of the ``tiles`` [k].

    ``complete`` means that these are all tiles of the layer. The pool keeps them until the last
    reference to the snapshot goes.
    """

    __slots__ = ("pool", "tiles", "indices", "complete")

    def __init__(self, pool: TilePool, tiles: np.ndarray, indices: np.ndarray,
                 complete: bool) -> None:
        self.pool, self.tiles, self.indices, self.complete = pool, tiles, indices, complete
        kernels.hold_all(indices, pool.arrays.refs)

    def __del__(self, drop_all: Callable[..., None] = kernels.drop_all,
                at_exit: Callable[[], bool] = sys.is_finalizing) -> None:
        if not at_exit():  # kernels cannot be called any more, and the memory goes anyway
            drop_all(self.indices, self.pool.arrays)

    def only(self, tiles: np.ndarray) -> LayerSnapshot:
        """A part of a complete snapshot: these tiles."""
        return LayerSnapshot(self.pool, tiles, self.indices[tiles], False)

    def filled(self) -> np.ndarray:
        """The numbers of the tiles that hold any evidence."""
        return self.tiles[self.indices != 0]

    def cells(self) -> np.ndarray:
        """[k, 1024] int8 log-odds, a copy."""
        cells: np.ndarray = self.pool.arrays.data[self.indices]
        return cells


class Layer:
    """The evidence of one source: int32 ``indices`` [tiles] into the pool, copied on write."""

    __slots__ = ("pool", "tiles", "indices", "_latest")

    def __init__(self, pool: TilePool, tiles: np.ndarray) -> None:
        self.pool, self.tiles = pool, tiles
        self.indices = np.zeros(len(tiles), np.int32)
        self._latest: LayerSnapshot | None = None

    def __del__(self, drop_all: Callable[..., None] = kernels.drop_all,
                at_exit: Callable[[], bool] = sys.is_finalizing) -> None:
        if not at_exit():  # kernels cannot be called any more, and the memory goes anyway
            drop_all(self.indices, self.pool.arrays)

    def snapshot(self) -> LayerSnapshot:
        """The layer as it is now; the same object until the layer changes."""
        if self._latest is None:
            self._latest = LayerSnapshot(self.pool, self.tiles, self.indices.copy(), True)
        return self._latest

    def changing(self) -> None:
        """Let go of the snapshot that is kept for the next caller, so that its tiles need no copy
        unless it is held elsewhere. To be called before the layer is written to."""
        self._latest = None

    def changed_since(self, before: LayerSnapshot) -> np.ndarray:
        """The numbers of the tiles written to since the complete snapshot ``before`` was taken (its
        tiles stay its own as long as it is held)."""
        return self.tiles[self.indices != before.indices]


class ReceivedLayer(Layer):
    """The evidence received from another source: ``sent`` [tiles] has the version that each tile
    was sent with, -1 for none, ``newest`` the newest of them."""

    __slots__ = ("sent", "newest")

    def __init__(self, pool: TilePool, tiles: np.ndarray) -> None:
        super().__init__(pool, tiles)
        self.sent = np.full(len(tiles), -1)
        self.newest = -1

    def receiving(self, version: int, snapshot: LayerSnapshot) -> None:
        """Keep ``snapshot`` as that of the layer if it is complete and the newest. To be called
        before tiles are replaced."""
        self._latest = snapshot if snapshot.complete and version > self.newest else None
        self.newest = max(self.newest, version)


class _Scans:
    """Integrates scans, one at a time, into all maps of one raster."""

    def __init__(self, spec: GridSpec) -> None:
        count = math.prod(tiles_across(spec)) * CELLS
        self._spec = spec
        self._scan = np.zeros(1, evidence.SCAN)
        self._sheet = evidence.Sheet(cell_numbers(spec), np.zeros(count, np.uint8),
                                     np.empty(count + 1, np.uint32))
        self._stamp = 0  # that of the last scan; no cell is marked with the next one

    def integrate(self, x_m: float, y_m: float, yaw_rad: float, scan: LaserScan,
                  usable_range_m: float, belief: Belief) -> int:
        """See ``Belief.integrate_scan``. Returns the number of changed tiles."""
        spec = self._spec
        self._stamp = self._stamp % 255 + 1
        if self._stamp == 1:
            self._sheet.marks[:] = 0
        per_m = 1.0 / spec.resolution_m
        self._scan[0] = (
            (x_m - spec.x_m) * per_m, (y_m - spec.y_m) * per_m, yaw_rad, scan.angle_min_rad,
            scan.angle_increment_rad, per_m, float(np.float32(scan.range_max_m)) * per_m,
            usable_range_m * per_m, spec.width, spec.height, self._stamp)
        count: int = evidence.integrate(scan.ranges, self._scan, self._sheet, belief.version + 1,
                                        belief.own.indices, belief.pool.arrays, belief.sum)
        return count


_scans = lru_cache(maxsize=4)(_Scans)


class Belief:
    """The knowledge of one robot: ``fused`` int16 [tiles, 1024], the sum of all its layers, always
    up to date. A sum of int16 holds 468 sources at the clamp.

    ``version`` counts the changes of knowledge: cells that became free, occupied or unknown. More
    evidence for what they are already changes nothing. ``tile_version`` [tiles] has the version of
    each tile's last change, after which ``observer(belief, changed_tiles)`` of all ``observers``
    are called.
    """

    def __init__(self, spec: GridSpec, pool: TilePool) -> None:
        self.spec, self.pool = spec, pool
        self.tiles_x, self.tiles_y = tiles_across(spec)
        self.tiles = np.arange(self.tiles_x * self.tiles_y, dtype=np.int32)
        self.fused = np.zeros((len(self.tiles), CELLS), np.int16)
        self.version = 0
        self.tile_version = np.zeros(len(self.tiles), np.int64)
        self.observers: list[Callable[[Belief, np.ndarray], None]] = []
        self.own = Layer(pool, self.tiles)
        self.received: dict[str, ReceivedLayer] = {}
        self.sum = kernels.Fused(self.fused, self.tile_version,
                                  np.empty(len(self.tiles), np.int32))
        self._scans = _scans(spec)

    def integrate_scan(self, x_m: float, y_m: float, yaw_rad: float, scan: LaserScan,
                       usable_range_m: float) -> None:
        """Add the evidence of a scan from this pose to the own layer and the sum. Beams of
        ``usable_range_m`` and more clear space up to there and mark nothing."""
        self.pool.reserve(len(self.tiles))
        self.own.changing()
        self._note(self._scans.integrate(x_m, y_m, yaw_rad, scan, usable_range_m, self))

    def receive(self, source: str, version: int, snapshot: LayerSnapshot) -> bool:
        """Take in ``source``'s evidence as of ``version``: each tile of ``snapshot`` replaces an
        older one. The newest of each tile wins, so order, duplicates and gaps do not matter. True
        if that changed the knowledge."""
        layer = self.received.get(source)
        if layer is None:
            layer = self.received[source] = ReceivedLayer(self.pool, self.tiles)
        layer.receiving(version, snapshot)
        count = kernels.replace(version, snapshot.tiles, snapshot.indices, self.version + 1,
                                layer.indices, layer.sent, self.pool.arrays, self.sum)
        self._note(count)
        return count > 0

    def layers(self) -> tuple[LayerSnapshot, ...]:
        """Snapshots of all layers, own first: the belief as it is now, immutable."""
        return (self.own.snapshot(), *(layer.snapshot() for layer in self.received.values()))

    def _note(self, count: int) -> None:
        if count:
            self.version += 1
            if self.observers:
                changed = self.sum.changed[:count].copy()
                for observer in self.observers:
                    observer(self, changed)


def fuse(layers: tuple[LayerSnapshot, ...]) -> np.ndarray:
    """int16 [tiles, 1024]: the sum of complete snapshots, from scratch."""
    total = np.zeros((len(layers[0].tiles), CELLS), np.int16)
    for layer in layers:
        total += layer.cells()
    return total
