"""Loops of maps in shared tiles: copies on write, and the evidence of a scan.

A tile has 8 x 8 cells. A map is two rows of indices into pools of tiles: of the visits by beams,
and of the returns. Tile 0 of each pool is empty and never counted.

These tiles are not those of ``desim.robot.mapping.kernels.tiles``, which hold log-odds.
A cell has counts, a mean place and a normal here, and a scan writes to the maps of all particles:
of small tiles fewer are copied.
"""

from typing import NamedTuple

import numpy as np

from desim.ports.kernels import cos, inner, lean, sin, types
from desim.robot.slam.kernels.points import NX, NY, X, Y

SIDE = 8  # cells along a side of a tile
CELLS = 64  # of a tile
MOST = 30_000  # counts of a cell stop here (int16)
FIXED = 4294967296.0  # one, in fixed point
# A cell is occupied if at least this share of its visits were returns (ours; gmapping: 0.1 to
# match, 0.25 to publish).
OCCUPIED = 0.2


class Stock(NamedTuple):
    """The tiles of a pool, in use and free: ``refs`` [capacity] number of references, ``free``
    [capacity], of which the first ``free_count[0]`` are the tiles without any."""

    refs: np.ndarray
    free: np.ndarray
    free_count: np.ndarray


class Maps(NamedTuple):
    """The maps of all particles.

    ``visit_tiles`` [particles, tiles] indices into the pool ``visits`` [capacity, 64] int16 |
    ``hit_tiles`` [particles, tiles] indices into the pool ``hits`` [capacity, 64] int16, ``means``
    [capacity, 64, 4] float32: of returns, their offset from the centre of the cell in m, and their
    normals | ``columns``: tiles in a row | ``left``, ``low``: the first tile's place in tiles |
    ``resolution_m``.
    """

    visit_tiles: np.ndarray
    hit_tiles: np.ndarray
    visits: np.ndarray
    hits: np.ndarray
    means: np.ndarray
    visit_stock: Stock
    hit_stock: Stock
    columns: int
    left: int
    low: int
    resolution_m: float


_i4x1, _i4x2, _i2x2 = types.int32[::1], types.int32[:, ::1], types.int16[:, ::1]
_f8, _i8, _f8x2 = types.float64, types.int64, types.float64[:, ::1]
STOCK = types.NamedTuple([_i4x1, _i4x1, types.int64[::1]], Stock)
MAPS = types.NamedTuple([_i4x2, _i4x2, _i2x2, _i2x2, types.float32[:, :, ::1], STOCK, STOCK, _i8,
                         _i8, _i8, _f8], Maps)


@inner(types.void(types.int32, STOCK))
def release(index, stock):
    """One reference less to a tile; at zero it is free."""
    if index != 0:
        stock.refs[index] -= 1
        if stock.refs[index] == 0:
            stock.free[stock.free_count[0]] = index
            stock.free_count[0] += 1


@inner(types.int32(STOCK))
def take(stock):
    """A free tile, with one reference."""
    stock.free_count[0] -= 1
    fresh = stock.free[stock.free_count[0]]
    stock.refs[fresh] = 1
    return fresh


@inner(types.int32(_i8, _i8, MAPS))
def own_visits(particle, tile, maps):
    """The particle's own tile of visits: a copy, if others share it."""
    index = maps.visit_tiles[particle, tile]
    if index != 0 and maps.visit_stock.refs[index] == 1:
        return index
    fresh = take(maps.visit_stock)
    for c in range(CELLS):
        maps.visits[fresh, c] = maps.visits[index, c]
    release(index, maps.visit_stock)
    maps.visit_tiles[particle, tile] = fresh
    return fresh


@inner(types.int32(_i8, _i8, MAPS))
def own_hits(particle, tile, maps):
    """The particle's own tile of returns: a copy, if others share it."""
    index = maps.hit_tiles[particle, tile]
    if index != 0 and maps.hit_stock.refs[index] == 1:
        return index
    fresh = take(maps.hit_stock)
    for c in range(CELLS):
        maps.hits[fresh, c] = maps.hits[index, c]
        for k in range(4):
            maps.means[fresh, c, k] = maps.means[index, c, k]
    release(index, maps.hit_stock)
    maps.hit_tiles[particle, tile] = fresh
    return fresh


@lean(types.void(types.int64[::1], MAPS, _i4x2, _i4x2))
def resample(ancestors, maps, visit_tiles, hit_tiles):
    """Write tables in which particle k has the map of particle ``ancestors[k]``; all tiles are
    shared at first.

    ``ancestors`` [particles after] | ``visit_tiles``, ``hit_tiles`` [particles after, tiles], out.
    """
    before, after = len(maps.visit_tiles), len(ancestors)
    for k in range(after):
        for t in range(visit_tiles.shape[1]):
            visit_tiles[k, t] = maps.visit_tiles[ancestors[k], t]
            hit_tiles[k, t] = maps.hit_tiles[ancestors[k], t]
            if ancestors[k] != k:
                if visit_tiles[k, t] != 0:
                    maps.visit_stock.refs[visit_tiles[k, t]] += 1
                if hit_tiles[k, t] != 0:
                    maps.hit_stock.refs[hit_tiles[k, t]] += 1
    for k in range(before):
        if k >= after or ancestors[k] != k:
            for t in range(visit_tiles.shape[1]):
                release(maps.visit_tiles[k, t], maps.visit_stock)
                release(maps.hit_tiles[k, t], maps.hit_stock)


@inner(types.void(_i8, types.float64[::1], _f8, _f8, _f8x2, _i8, MAPS))
def visit(particle, pose, mount_x, mount_y, lines, drawn, maps):
    """Count a visit in each cell from the laser to a cell short of each of ``lines``: one cell a
    step along the longer axis (Bresenham's line)."""
    x, y, c, s = pose[0], pose[1], cos(pose[2]), sin(pose[2])
    per_m = 1.0 / maps.resolution_m
    from_x = (x + c * mount_x - s * mount_y) * per_m - maps.left * SIDE
    from_y = (y + s * mount_x + c * mount_y) * per_m - maps.low * SIDE
    columns, visits, refs = maps.columns, maps.visits, maps.visit_stock.refs
    last, index, own = -1, np.int32(0), np.uint64(0)
    for k in range(drawn):
        along_x = (x + c * lines[k, X] - s * lines[k, Y]) * per_m - maps.left * SIDE - from_x
        along_y = (y + s * lines[k, X] + c * lines[k, Y]) * per_m - maps.low * SIDE - from_y
        steps = int(max(abs(along_x), abs(along_y)))
        part = 1.0 / max(steps, 1)
        step_x, step_y = int(along_x * part * FIXED), int(along_y * part * FIXED)
        at_x, at_y = int(from_x * FIXED), int(from_y * FIXED)
        for _ in range(steps):
            column, row = at_x >> 32, at_y >> 32
            tile = (row >> 3) * columns + (column >> 3)
            if tile != last:
                last, index = tile, maps.visit_tiles[particle, tile]
                if index == 0 or refs[index] != 1:
                    index = own_visits(particle, tile, maps)
                own = np.uint64(index)
            cell = np.uint64(((row & 7) << 3) | (column & 7))  # an index that may be negative costs
            if visits[own, cell] < MOST:
                visits[own, cell] += np.int16(1)
            at_x += step_x
            at_y += step_y


@inner(types.void(_i8, types.float64[::1], _f8, _f8, _f8x2, _i8, _f8x2, _i8, MAPS))
def register(particle, pose, mount_x, mount_y, points, count, lines, drawn, maps):
    """Add a scan, seen from a pose [3] (m, m, rad), to a particle's map: visits along the beams to
    ``lines`` (the first ``drawn``), and returns at ``points`` (the first ``count``)."""
    visit(particle, pose, mount_x, mount_y, lines, drawn, maps)
    x, y, c, s = pose[0], pose[1], cos(pose[2]), sin(pose[2])
    per_m = 1.0 / maps.resolution_m
    last, visit_tile, hit_tile = -1, np.int32(0), np.int32(0)
    for k in range(count):
        px, py = points[k, X], points[k, Y]
        at_x = (x + c * px - s * py) * per_m - maps.left * SIDE
        at_y = (y + s * px + c * py) * per_m - maps.low * SIDE
        column, row = int(at_x), int(at_y)
        tile = (row >> 3) * maps.columns + (column >> 3)
        cell = ((row & 7) << 3) | (column & 7)
        if tile != last:  # a call that hands over the maps costs as much as five cells
            last = tile
            visit_tile, hit_tile = own_visits(particle, tile, maps), own_hits(particle, tile, maps)
        if maps.visits[visit_tile, cell] < MOST:
            maps.visits[visit_tile, cell] += 1
        if maps.hits[hit_tile, cell] < MOST:
            maps.hits[hit_tile, cell] += 1
            means, part = maps.means[hit_tile, cell], 1.0 / maps.hits[hit_tile, cell]
            means[0] += ((at_x - column - 0.5) * maps.resolution_m - means[0]) * part
            means[1] += ((at_y - row - 0.5) * maps.resolution_m - means[1]) * part
            means[2] += (c * points[k, NX] - s * points[k, NY] - means[2]) * part
            means[3] += (s * points[k, NX] + c * points[k, NY] - means[3]) * part


@lean(types.int64(_i8, _f8x2, _f8, _f8, _f8x2, _i8, _f8x2, _i8, _i8, MAPS))
def register_all(first, poses, mount_x, mount_y, points, count, lines, drawn, visited, maps):
    """Add a scan to the maps of the particles from ``first`` on, each at its pose [particles, 3].

    Returns the first particle for whose map too few tiles are free: a scan changes up to
    ``visited`` tiles of visits, and one of returns for each point. ``mount_x``, ``mount_y``: the
    laser on the robot in m | ``lines``: points to which visits are counted.
    """
    for k in range(first, len(poses)):
        if maps.visit_stock.free_count[0] < visited or maps.hit_stock.free_count[0] < count:
            return k
        register(k, poses[k], mount_x, mount_y, points, count, lines, drawn, maps)
    return len(poses)


@lean(types.void(_i8, types.int16[:, ::1], types.int16[:, ::1], MAPS))
def unroll(particle, visits, hits, maps):
    """Write a particle's counts as grids [rows, columns of cells]."""
    rows = maps.visit_tiles.shape[1] // maps.columns
    for row in range(rows):
        for column in range(maps.columns):
            tile = row * maps.columns + column
            visit_tile, hit_tile = maps.visit_tiles[particle, tile], maps.hit_tiles[particle, tile]
            for cell in range(CELLS):
                r, c = row * SIDE + (cell >> 3), column * SIDE + (cell & 7)
                visits[r, c] = maps.visits[visit_tile, cell]
                hits[r, c] = maps.hits[hit_tile, cell]


@lean(_i8(MAPS, _i8, types.uint64[::1], types.uint64[:, :, ::1]))
def count_patches(maps, side, weights, hashes):
    """The number of different patches of ``side`` x ``side`` tiles in all maps, without empty ones.
    A tile stands at one place only, so that patches at two places differ.

    ``weights`` [side * side]: those of the tiles in a patch | ``hashes`` [particles, rows,
    columns]: zeros; afterwards the hash of each patch, 0 where it is empty.
    """
    low, left = maps.low // side, maps.left // side
    particles, tiles = maps.visit_tiles.shape
    for tile in range(tiles):
        y, x = maps.low + tile // maps.columns, maps.left + tile % maps.columns
        row, column = y // side - low, x // side - left
        weight = weights[y % side * side + x % side]
        for particle in range(particles):
            hashes[particle, row, column] += np.uint64(maps.visit_tiles[particle, tile]) * weight
    _, rows, columns = hashes.shape
    count = 0
    for row in range(rows):
        for column in range(columns):
            for particle in range(particles):
                mine, other = hashes[particle, row, column], 0
                while hashes[other, row, column] != mine:
                    other += 1
                if mine != 0 and other == particle:
                    count += 1
    return count
