"""Grids of evidence in shared tiles, copied on write.

Evidence is log-odds in integers, so that sums are exact and their order does not matter. A layer is
the evidence of one source; a robot's map (``robot_map.py``) sums several. Tiles are 32 x 32 cells
and copied at the first write to a shared one: a layer on its way through the network costs a few
hundred bytes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from desim.compiler.kernel import compiled_function
from desim.ports import GridSpec
from desim.robot.mapping.kernels import tiles as kernels

TILE = 32
CELLS = TILE * TILE
_hold_all = compiled_function(kernels.hold_all)
_drop_all = compiled_function(kernels.drop_all)
_subtract = compiled_function(kernels.subtract)

FREE, OCCUPIED = int(kernels.FREE), int(kernels.OCCUPIED)  # the sum's thresholds


def tiles_across(spec: GridSpec) -> tuple[int, int]:
    """Columns and rows of tiles that cover the grid."""
    return -(-spec.width // TILE), -(-spec.height // TILE)


def raster(spec: GridSpec, tiles: np.ndarray) -> np.ndarray:
    """[height, width] cells, row 0 at the bottom, of ``tiles`` [tiles, 1024]."""
    across, up = tiles_across(spec)
    whole = tiles.reshape(up, across, TILE, TILE).swapaxes(1, 2).reshape(up * TILE, across * TILE)
    return np.ascontiguousarray(whole[:spec.height, :spec.width])


def cropped(cells: np.ndarray) -> tuple[int, int, np.ndarray]:
    """The first row, the first column and a copy of the box of ``cells`` [rows, columns] that are
    not zero; where there is none, the box is the first cell."""
    rows, columns = np.flatnonzero(cells.any(axis=1)), np.flatnonzero(cells.any(axis=0))
    if not len(rows):
        rows = columns = np.zeros(1, np.int64)
    row, column = int(rows[0]), int(columns[0])
    return row, column, cells[row:int(rows[-1]) + 1, column:int(columns[-1]) + 1].copy()


def occupancy(spec: GridSpec, fused: np.ndarray) -> np.ndarray:
    """[height, width] int8 as nav_msgs/OccupancyGrid has it: 0 free, 100 occupied, -1 unknown; of
    the sum of evidence ``fused`` [tiles, 1024]."""
    evidence = raster(spec, fused)
    return np.where(evidence <= FREE, 0, np.where(evidence >= OCCUPIED, 100, -1)).astype(np.int8)


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

    def reserve(self, tiles: int) -> None:
        """Double the pool until ``tiles`` are free."""
        while self.arrays.free_count[0] < tiles:
            data, refs, free, free_count = self.arrays
            capacity = len(data)
            fresh = np.arange(2 * capacity - 1, capacity - 1, -1, dtype=np.int32)
            self.arrays = kernels.Pool(np.concatenate((data, np.zeros_like(data))),
                                       np.concatenate((refs, np.zeros_like(refs))),
                                       np.concatenate((fresh, free)),
                                       free_count + capacity)


class LayerSnapshot:
    """A source's evidence at an instant, immutable: pool ``indices`` [k] of the ``tiles`` [k].

    ``complete`` means that these are all tiles of the layer. The pool keeps them until the last
    reference to the snapshot goes.
    """

    __slots__ = ("pool", "tiles", "indices", "complete", "changes")

    def __init__(self, pool: TilePool, tiles: np.ndarray, indices: np.ndarray,
                 complete: bool) -> None:
        self.pool, self.tiles, self.indices, self.complete = pool, tiles, indices, complete
        self.changes: dict[tuple[int, int], Replacement] | None = None  # at receivers
        _hold_all(indices, pool.arrays.refs)

    def __del__(self, drop_all: Callable[..., None] = _drop_all,
                at_exit: Callable[[], bool] = sys.is_finalizing) -> None:
        if not at_exit():  # kernels cannot be called any more, and the memory goes anyway
            drop_all(self.indices, self.pool.arrays)

    def only(self, tiles: np.ndarray) -> LayerSnapshot:
        """A part of a complete snapshot: these tiles."""
        return LayerSnapshot(self.pool, tiles, self.indices[tiles], False)

    def changed_since(self, before: LayerSnapshot) -> np.ndarray:
        """The numbers of the tiles written to since ``before``, which was held all the time; both
        are complete and of one source."""
        return self.tiles[self.indices != before.indices]

    def filled(self) -> np.ndarray:
        """The numbers of the tiles that hold any evidence."""
        return self.tiles[self.indices != 0]

    def cells(self) -> np.ndarray:
        """[k, 1024] int8 log-odds, a copy."""
        return self.pool.arrays.data[self.indices]


def drawn(pool: TilePool, spec: GridSpec, log_odds: np.ndarray) -> LayerSnapshot:
    """A complete snapshot of int8 ``log_odds`` [height, width], row 0 at the bottom."""
    cells = tiles_of(spec, log_odds)
    filled = np.flatnonzero(cells.any(axis=1)).astype(np.int32)
    pool.reserve(len(filled))
    data, _, free, free_count = pool.arrays
    free_count[0] -= len(filled)
    indices = np.zeros(len(cells), np.int32)
    indices[filled] = free[free_count[0]:free_count[0] + len(filled)]
    data[indices[filled]] = cells[filled]
    return LayerSnapshot(pool, np.arange(len(cells), dtype=np.int32), indices, True)


class Layer:
    """The evidence of one source: int32 ``indices`` [tiles] into the pool, copied on write."""

    __slots__ = ("pool", "tiles", "indices", "_latest")

    def __init__(self, pool: TilePool, tiles: np.ndarray) -> None:
        self.pool, self.tiles = pool, tiles
        self.indices = np.zeros(len(tiles), np.int32)
        self._latest: LayerSnapshot | None = None

    @classmethod
    def of(cls, whole: LayerSnapshot) -> Layer:
        """A layer with the evidence of a complete snapshot."""
        layer = cls(whole.pool, whole.tiles)
        layer.indices[:] = whole.indices
        _hold_all(layer.indices, whole.pool.arrays.refs)
        layer._latest = whole
        return layer

    def __del__(self, drop_all: Callable[..., None] = _drop_all,
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


class Received(LayerSnapshot):
    """The evidence received from another source, of all its tiles: ``sent`` [tiles] has the version
    that each was sent with, -1 for none, ``newest`` the newest of them.

    It is immutable, and robots that took in the same updates share it: so a fleet of n robots that
    hear each other needs memory for n of them and not for n^2.
    """

    __slots__ = ("sent", "newest")

    def __init__(self, pool: TilePool, tiles: np.ndarray, indices: np.ndarray, sent: np.ndarray,
                 newest: int) -> None:
        super().__init__(pool, tiles, indices, True)
        self.sent, self.newest = sent, newest


class Replacement(NamedTuple):
    """The evidence ``before`` an update and ``after`` it: in ``tiles`` [k] it changes by
    ``differences`` int16 [k, 1024], computed once for all robots that take in the update."""

    before: Received | None
    after: Received
    tiles: np.ndarray
    differences: np.ndarray


def replacement(before: Received | None, tiles: np.ndarray, version: int,
                update: LayerSnapshot) -> Replacement:
    """The change that ``update``, sent with ``version``, makes of evidence of all ``tiles``: each
    of its tiles replaces an older one. ``before`` None: nothing was received yet. The update keeps
    what it changes for the other robots that it comes to."""
    key = id(before), version  # the change holds ``before``, so that its id stays its own
    if update.changes is None:
        update.changes = {}
    found = update.changes.get(key)
    if found is None:
        found = update.changes[key] = _replaced(before, tiles, version, update)
    return found


def _replaced(before: Received | None, tiles: np.ndarray, version: int,
              update: LayerSnapshot) -> Replacement:
    if before is None:
        indices, sent = np.zeros(len(tiles), np.int32), np.full(len(tiles), -1)
    else:
        indices, sent = before.indices.copy(), before.sent.copy()
    newer = version > sent[update.tiles]
    replaced = update.tiles[newer]
    old, new = indices[replaced], update.indices[newer]
    indices[replaced], sent[replaced] = new, version
    if before is not None and not len(replaced):
        after = before
    elif before is not None and update.complete and version > before.newest:
        after = replacement(None, tiles, version, update).after  # whatever was before is forgotten
    else:
        newest = version if before is None else max(version, before.newest)
        after = Received(update.pool, tiles, indices, sent, newest)
    differ = old != new
    return Replacement(before, after, replaced[differ],
                       difference_of(update.pool, new[differ], old[differ]))


def difference_of(pool: TilePool, new: np.ndarray, old: np.ndarray) -> np.ndarray:
    """int16 [k, 1024]: the evidence of the tiles ``new`` [k] of the pool minus that of ``old``."""
    differences = np.empty((len(new), CELLS), np.int16)
    _subtract(new, old, pool.arrays.data, differences)
    return differences


def fuse(layers: tuple[LayerSnapshot, ...]) -> np.ndarray:
    """int16 [tiles, 1024]: the sum of complete snapshots, from scratch."""
    total = np.zeros((len(layers[0].tiles), CELLS), np.int16)
    for layer in layers:
        total += layer.cells()
    return total
