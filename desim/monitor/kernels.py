"""Known cells of a map, tile by tile: how many there are, and since when."""

from __future__ import annotations

import numpy as np

from desim.ports.kernels import lean
from desim.robot.mapping.tiles import CELLS, FREE, OCCUPIED, TILE

_FREE, _OCCUPIED = np.int16(FREE), np.int16(OCCUPIED)
_NEVER = np.uint16(65535)


@lean("i8(i2[:, ::1], u1[:, ::1], i8[::1], i4[:, ::1], i4[::1], i8, u1[:, ::1], u1[:, :, ::1],"
      "i8[::1])")
def recount(fused, inside, tile_version, row_version, tiles, robot, union, known, total):
    """Count again the cells that ``tiles`` of one robot's map know, in the rows that changed with
    their tile, and add them to the union.

    fused [T, 1024] log-odds | inside [T, 1024] 1 where a cell counts | tile_version [T],
    row_version [T, 32] | tiles [k] changed tiles | robot its row | union [T, 1024] 1 where some
    robot has known the cell | known [R + 1, T, 32] counts of each robot, and of the union in the
    last row | total [R + 1] their sums. Returns the robot's total << 32 | the union's: one number
    crosses faster than two.

    Plain loops over a row of cells: each of them becomes vector instructions.
    """
    last = known.shape[0] - 1
    for k in range(tiles.shape[0]):
        tile = tiles[k]
        values, mask, seen = fused[tile], inside[tile], union[tile]
        for row in range(np.uint64(TILE)):
            if row_version[tile, row] != tile_version[tile]:
                continue
            first, own, all_ = row * np.uint64(TILE), np.int16(0), np.int16(0)
            for cell in range(first, first + np.uint64(TILE)):
                value = values[cell]
                is_known = mask[cell] & np.uint8((value <= _FREE) | (value >= _OCCUPIED))
                seen[cell] |= is_known
                own = np.int16(own + np.int16(is_known))
                all_ = np.int16(all_ + np.int16(seen[cell]))
            total[robot] += own - np.int64(known[robot, tile, row])
            total[last] += all_ - np.int64(known[last, tile, row])
            known[robot, tile, row] = own
            known[last, tile, row] = all_
    return total[robot] << 32 | total[last]


@lean("b1(i2[:, ::1], u1[:, ::1], u1[:, ::1], i8[::1])")
def known_elsewhere(fused, inside, union, cells):
    """Whether one robot's map lacks some of ``cells``, and some robot has known each of these.

    fused [T, 1024] its log-odds | inside [T, 1024] 1 where a cell counts | union [T, 1024] 1 where
    some robot has known the cell | cells [k] numbers, tile * 1024 + place in the tile.
    """
    lacking = False
    for number in cells:
        tile, place = number // CELLS, number % CELLS
        value = fused[tile, place]
        if inside[tile, place] == 1 and value > _FREE and value < _OCCUPIED:
            if union[tile, place] == 0:
                return False
            lacking = True
    return lacking


@lean("void(i2[:, ::1], i8[::1], i4[:, ::1], i4[::1], i8, u2, u2[:, ::1])")
def note_known(fused, tile_version, row_version, tiles, halvings, now, known_since):
    """Write ``now`` where cells of ``tiles`` have become known, in the rows that changed with their
    tile.

    fused [T, 1024] log-odds | tile_version [T], row_version [T, 32] | tiles [k] changed tiles |
    halvings: a square of 2^halvings cells a side is one place | known_since [T, 1024 >> 2
    halvings], 65535 where nothing is known yet.
    """
    side = np.int64(TILE) >> halvings
    for k in range(tiles.shape[0]):
        tile = tiles[k]
        values, since = fused[tile], known_since[tile]
        for row in range(np.uint64(TILE)):
            if row_version[tile, row] != tile_version[tile]:
                continue
            first = row * np.uint64(TILE)
            if halvings == 0:  # as vector instructions: 70 in place of 1050 ns a tile
                for cell in range(first, first + np.uint64(TILE)):
                    value = values[cell]
                    is_known = (value <= _FREE) | (value >= _OCCUPIED)
                    since[cell] = min(since[cell], now if is_known else _NEVER)
                continue
            for column in range(TILE):
                value = values[first + np.uint64(column)]
                if value <= _FREE or value >= _OCCUPIED:
                    place = (np.int64(row) >> halvings) * side + (column >> halvings)
                    since[place] = min(since[place], now)
