"""Loops of shared tiles: copies on write, and their sum.

A layer is ``indices`` [tiles] into the pool. Callers see to it that enough tiles are free. A cell
of the sum is known free at or below ``FREE``, known occupied at or above ``OCCUPIED``, and unknown
between them: where nothing was seen, or exactly as much for a wall as against one. So a cell in
which a body was seen, and which is free later, does not become unknown, and no robot drives there.
"""

from typing import NamedTuple

import numpy as np

from desim.ports.kernels import inner, kernel, lean, types

# Log-odds in units of 0.05 nat: hit 0.85, miss -0.4 (OctoMap, Hornung et al. 2013, section 5).
HIT, MISS = 17, -8

# The more probable state counts: OctoMap's threshold of 0.5.
FREE, OCCUPIED = np.int16(-1), np.int16(1)


class Pool(NamedTuple):
    """The tiles of all layers: ``data`` [capacity, 1024] int8 log-odds | ``refs`` [capacity] int32
    number of references to a tile | ``free[:free_count[0]]`` the tiles without any. Tile 0 is
    empty and never counted."""

    data: np.ndarray
    refs: np.ndarray
    free: np.ndarray
    free_count: np.ndarray


class Fused(NamedTuple):
    """The sum of a map's layers: ``fused`` [tiles, 1024] int16 log-odds | ``tile_version``
    [tiles] version of the last change | ``row_version`` [tiles, 32] the same of a tile's rows of
    cells | ``changed`` [tiles], out: the tiles in which a cell became free, occupied or unknown,
    each once | ``first`` [tiles], all -1, and ``difference`` [1024] int16, to work in."""

    fused: np.ndarray
    tile_version: np.ndarray
    row_version: np.ndarray
    changed: np.ndarray
    first: np.ndarray
    difference: np.ndarray


_i4x1, _i8, _i8x1 = types.int32[::1], types.int64, types.int64[::1]
POOL = types.NamedTuple([types.int8[:, ::1], _i4x1, _i4x1, _i8x1], Pool)
FUSED = types.NamedTuple([types.int16[:, ::1], _i8x1, types.int32[:, ::1], _i4x1, _i4x1,
                          types.int16[::1]], Fused)


@inner(types.void(types.int32, POOL))
def drop(index, pool):
    """Release a reference to a tile, which is free when there is none left."""
    if index != 0:
        pool.refs[index] -= 1
        if pool.refs[index] == 0:
            pool.free[pool.free_count[0]] = index
            pool.free_count[0] += 1


@lean("void(i4[::1], i4[::1])")
def hold_all(indices, refs):
    """Add a reference to each tile of a layer."""
    for k in range(len(indices)):
        if indices[k] != 0:
            refs[indices[k]] += 1


@lean(types.void(_i4x1, POOL))
def drop_all(indices, pool):
    """Release a reference to each tile of a layer."""
    for k in range(len(indices)):
        drop(indices[k], pool)


@kernel(types.void(_i8, _i4x1, POOL), inner=True)
def make_own(tile, indices, pool):
    """Copy on write: afterwards no other layer points to this layer's ``tile``."""
    index = indices[tile]
    if index != 0 and pool.refs[index] == 1:
        return
    pool.free_count[0] -= 1
    fresh = pool.free[pool.free_count[0]]
    for c in range(1024):
        pool.data[fresh, c] = pool.data[index, c]
    pool.refs[fresh] = 1
    drop(index, pool)
    indices[tile] = fresh


@lean("void(i4[::1], i4[::1], i1[:,::1], i2[:,::1])")
def subtract(new, old, data, differences):
    """The evidence ``new`` [k] minus ``old`` [k], to ``differences`` [k, 1024]."""
    for k in range(len(new)):
        minuend, subtrahend, difference = data[new[k]], data[old[k]], differences[k]
        for c in range(1024):
            difference[c] = np.int16(np.int16(minuend[c]) - np.int16(subtrahend[c]))


@inner(["b1(i2[::1], i2[::1])", "b1(i1[::1], i2[::1])"])
def add(difference, fused):
    """Add to a tile of the sum. Returns whether a cell became free, occupied or unknown. It is a
    plain loop, which becomes vector instructions.

    A cell crosses a threshold where its distance from it changes its sign: ``turned`` collects sign
    bits (8 % faster than comparisons).
    """
    turned = np.int16(0)
    for c in range(1024):
        before = fused[c]
        after = np.int16(before + difference[c])
        turned = np.int16(turned | np.int16(FREE - before) ^ np.int16(FREE - after)
                          | np.int16(before - OCCUPIED) ^ np.int16(after - OCCUPIED))
        fused[c] = after
    return turned < 0


@inner(["void(i2[::1], i4, i2[::1], i4[::1])", "void(i1[::1], i4, i2[::1], i4[::1])"])
def note_rows(difference, version, fused, row_version):
    """Note the rows of a tile in which a cell became free, occupied or unknown by ``add``. One tile
    in five has any, so that this costs less than a test of each row there."""
    for row in range(np.uint64(32)):
        turned = np.int16(0)
        for c in range(row << np.uint64(5), (row + np.uint64(1)) << np.uint64(5)):
            after = fused[c]
            before = np.int16(after - difference[c])
            turned = np.int16(turned | np.int16(FREE - before) ^ np.int16(FREE - after)
                              | np.int16(before - OCCUPIED) ^ np.int16(after - OCCUPIED))
        if turned < 0:
            row_version[row] = version


@inner("void(i2[::1], i2[::1])")
def copy(tile, to):
    """Copy a tile of differences."""
    for c in range(1024):
        to[c] = tile[c]


@inner("void(i2[::1], i2[::1])")
def collect(difference, total):
    """Add a tile of differences to another one."""
    for c in range(1024):
        total[c] += difference[c]


@lean("i8(i2[:,::1], i8, i2[:,::1])")
def append(differences, at, together):
    """Copy tiles of differences to ``together`` from ``at`` on. Returns the place behind them. (By
    tiles: a copy of all at once is ``rep movsb``, which callgrind counts by the byte.)"""
    for k in range(len(differences)):
        copy(differences[k], together[at + k])
    return at + len(differences)


@lean(types.int64(_i4x1, types.int16[:, ::1], _i4x1, _i8, FUSED))
def add_all(tiles, differences, after, version, total):
    """Add ``differences`` [k, 1024] to ``tiles`` [k] of the sum, which is of ``version`` then.
    Returns the number of tiles in ``total.changed``.

    A tile may be there several times: the sum, which is in no cache, is visited once for all of
    them. ``after`` [k] to work in: the next entry of the same tile.
    """
    first, count = total.first, 0
    for k in range(len(tiles)):
        after[k] = first[tiles[k]]
        first[tiles[k]] = k
    for tile in range(len(first)):
        k = first[tile]
        if k < 0:
            continue
        first[tile] = -1
        difference = differences[k]
        if after[k] >= 0:
            difference = total.difference
            copy(differences[k], difference)
        while after[k] >= 0:
            k = after[k]
            collect(differences[k], difference)
        if add(difference, total.fused[tile]):
            total.tile_version[tile] = version
            note_rows(difference, version, total.fused[tile], total.row_version[tile])
            total.changed[count] = tile
            count += 1
    return count


@lean("void(i1[:,::1], i4[:,::1], i2[:,::1])")
def choose_first(data, indices, fused):
    """The evidence of the first source that knows a cell, or else that of the first source, in
    ``fused`` [k, 1024]. ``indices`` [sources, k] are tiles of ``data``."""
    for k in range(indices.shape[1]):
        chosen, own = fused[k], data[indices[0, k]]
        for c in range(1024):
            chosen[c] = own[c]
        for source in range(1, indices.shape[0]):
            if indices[source, k] == 0:
                continue
            other = data[indices[source, k]]
            for c in range(1024):
                known = (other[c] <= FREE) | (other[c] >= OCCUPIED)
                if (chosen[c] > FREE) & (chosen[c] < OCCUPIED) & known:
                    chosen[c] = other[c]
