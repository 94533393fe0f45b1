"""Loops of the grids: evidence from scans, and the exchange of tiles between layers.

A cell is one number: ``tile * 1024 + (row % 32) * 32 + (column % 32)``. A layer is ``indices``
[tiles] into the pool's ``data`` [capacity, 1024]; ``refs`` [capacity] counts who points to a tile,
and ``free[:free_count[0]]`` are the tiles that nobody points to. Tile 0 is empty, never counted.
Callers see to it that enough tiles are free. A tile in which a cell of the sum became free,
occupied or unknown is noted once in ``changed``, and ``tile_version`` gets the change's version.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from desim.ports.kernels import cos, lean, sin

# Log-odds in units of 0.05 nat: hit 0.85, miss -0.4, clamped to -2.0 .. 3.5 (OctoMap, Hornung et
# al. 2013, section 5).
HIT, MISS = 17, -8
CLAMP_LOW, CLAMP_HIGH = -40, 70

FREE = np.int16(MISS)  # a cell of the sum is known free at or below this: one miss
OCCUPIED = np.int16(HIT)  # known occupied at or above this: one hit; between them it is unknown

FIXED = 4294967296.0  # one, in the fixed point of ``walk``
DEPTH = 0.05  # cells; more than ranges err by rounding (float32), less than they err by noise


@lean("void(i4, i4[::1], i4[::1], i8[::1])")
def drop(index, refs, free, free_count):
    """One reference less to a tile; at zero it is free."""
    if index != 0:
        refs[index] -= 1
        if refs[index] == 0:
            free[free_count[0]] = index
            free_count[0] += 1


@lean("void(i4[::1], i4[::1])")
def hold_all(indices, refs):
    """One reference more to each tile of a layer."""
    for k in range(len(indices)):
        if indices[k] != 0:
            refs[indices[k]] += 1


@lean("void(i4[::1], i4[::1], i4[::1], i8[::1])")
def drop_all(indices, refs, free, free_count):
    """One reference less to each tile of a layer."""
    for k in range(len(indices)):
        drop(indices[k], refs, free, free_count)


@njit("void(i8, i4[::1], i1[:,::1], i4[::1], i4[::1], i8[::1])", cache=True)
def make_own(tile, indices, data, refs, free, free_count):
    """Copy on write: afterwards nobody else points to this layer's ``tile``."""
    index = indices[tile]
    if index != 0 and refs[index] == 1:
        return
    free_count[0] -= 1
    fresh = free[free_count[0]]
    data[fresh] = data[index]
    refs[fresh] = 1
    drop(index, refs, free, free_count)
    indices[tile] = fresh


@lean("f8(f8, f8, i8)")
def room(x, along_x, width):
    """How far a line may go before it leaves [0, width) in this direction."""
    if along_x > 0.0:
        return (width - 1e-6 - x) / along_x
    return x / -along_x if along_x < 0.0 else np.inf


@lean("u8(u8, u1, u1[::1], u8, u4[::1])")
def put(cell, stamp, marks, count, cells):
    """Append ``cell`` to ``cells`` if it is not marked, and mark it. Without a branch, which would
    be hard to predict; the list needs room for one more than the grid has cells."""
    cells[count] = cell
    unmarked = marks[cell] != stamp
    marks[cell] = stamp
    return count + np.uint64(unmarked)


@lean("u8(f8, f8, f8, f8, f8, i8, i8, u4[::1], u1, u1[::1], u8, u4[::1])")
def walk(x, y, along_x, along_y, length, width, height, numbers, stamp, marks, count, cells):
    """Mark with ``stamp`` the cells that a line of ``length`` from (x, y) along a unit vector goes
    through, in units of cells, up to the rim of the grid; append those that had no mark to
    ``cells``. Returns their new count.

    The cells are the exact ones; where the line meets a corner, also one beside it. From column
    to column along the longer axis: first the row where the line leaves the column, in fixed point
    (32 bits behind the point), so that it is at most one row away.
    """
    if not (0.0 <= x < width and 0.0 <= y < height):
        return count
    length = min(length, room(x, along_x, width), room(y, along_y, height))
    columns, rows = 0, width
    if abs(along_x) < abs(along_y):
        x, y, along_x, along_y, columns, rows = y, x, along_y, along_x, rows, columns
    step = 1 if along_x > 0.0 else -1
    slope = step * along_y / along_x
    edge = int(x) + (step + 1) // 2
    leave, climb = int((y + abs(edge - x) * slope) * FIXED), int(slope * FIXED)
    at = columns + int(x)
    count = put(numbers[at] + numbers[rows + int(y)], stamp, marks, count, cells)
    for _ in range(abs(int(x + along_x * length) - int(x))):
        row = numbers[rows + (leave >> 32)]
        count = put(numbers[at] + row, stamp, marks, count, cells)
        at += step
        leave += climb
        count = put(numbers[at] + row, stamp, marks, count, cells)
    last = numbers[rows + int(y + along_y * length)]
    return put(numbers[at] + last, stamp, marks, count, cells)


@lean("void(f8, f8, f8[:,::1], f8[:,::1], f8, i8, i8, u4[::1], u1, u1[::1], u8, u4[::1])")
def keep_walls(x, y, ray, end, no_return, width, height, numbers, stamp, marks, count, cells):
    """Mark the cells where a wall seems to go on: the line through the returns of two neighbouring
    beams, as far as the next beam. That beam, if it grazes the wall, runs through the wall's own
    cells before it meets or passes it, and must not erase them.

    With a, b the ends and u the direction of the next beam from o, b + s (b - a) = o + t u has the
    solution s = (o - b) x u / (b - a) x u.
    """
    for b in range(1, len(ray) - 1):
        for side in (-1, 1):
            if ray[b, 2] >= no_return or ray[b - side, 2] >= no_return:
                continue
            wall_x, wall_y = end[b, 0] - end[b - side, 0], end[b, 1] - end[b - side, 1]
            next_x, next_y = ray[b + side, 0], ray[b + side, 1]
            across = wall_x * next_y - wall_y * next_x
            if across == 0.0:
                continue
            part = ((x - end[b, 0]) * next_y - (y - end[b, 1]) * next_x) / across
            ahead = ((end[b, 0] + part * wall_x - x) * next_x
                     + (end[b, 1] + part * wall_y - y) * next_y)
            length = np.sqrt(wall_x * wall_x + wall_y * wall_y)
            if ahead > 0.0 and part * length > 1.0:  # else the two cells touch
                walk(end[b, 0], end[b, 1], wall_x / length, wall_y / length, part * length, width,
                     height, numbers, stamp, marks, count, cells)


@njit("UniTuple(i8, 2)(f8, f8, f8, f4[::1], f8, f8, f8, f8, f8, i8, i8, u4[::1], u1, u1[::1], "
      "u4[::1])", cache=True)
def sweep(x, y, yaw_rad, ranges, angle_min_rad, increment_rad, per_m, no_return, usable,
          width, height, numbers, stamp, marks, cells):
    """What one scan from (x, y) says: ``cells[:hits]`` are occupied, ``cells[hits:count]`` free,
    each at most once. Returns (hits, count). Lengths in cells, ``ranges`` in m; the number of a
    cell is ``numbers[column] + numbers[width + row]``.

    A return belongs to the matter behind the face that it came from, also where that face lies on
    the line between two cells: it is taken to be ``DEPTH`` farther away.

    Hits first. Then the continuations of walls (``keep_walls``), which are left as they are, and
    then the misses along the beams.
    """
    beams, count = len(ranges), np.uint64(0)
    ray, end = np.empty((beams, 3)), np.empty((beams, 2))
    for b in range(beams):
        angle = yaw_rad + angle_min_rad + b * increment_rad
        ray[b, 0], ray[b, 1], ray[b, 2] = cos(angle), sin(angle), ranges[b] * per_m
        if ray[b, 2] < no_return:
            ray[b, 2] += DEPTH
        end[b, 0], end[b, 1] = x + ray[b, 0] * ray[b, 2], y + ray[b, 1] * ray[b, 2]
        if (ray[b, 2] < min(usable, no_return) and 0.0 <= end[b, 0] < width
                and 0.0 <= end[b, 1] < height):
            count = put(numbers[int(end[b, 0])] + numbers[width + int(end[b, 1])], stamp, marks,
                        count, cells)
    hits = count
    keep_walls(x, y, ray, end, no_return, width, height, numbers, stamp, marks, count, cells)
    for b in range(beams):
        count = walk(x, y, ray[b, 0], ray[b, 1], min(ray[b, 2], usable), width, height, numbers,
                     stamp, marks, count, cells)
    return hits, count


@lean("i8(u4[::1], i8, i8, i8, i4[::1], i1[:,::1], i4[::1], i4[::1], i8[::1], i2[:,::1], "
      "i8[::1], i4[::1])")
def add_evidence(cells, amount, version, count, indices, data, refs, free, free_count, fused,
                 tile_version, changed):
    """Add ``amount`` to ``cells`` of a layer and to the sum. Returns the number of tiles in
    ``changed``, which was ``count``. A cell at its clamp already changes nothing."""
    for k in range(len(cells)):
        cell = np.int64(cells[k])
        tile, place = cell >> 10, cell & 1023
        old = data[indices[tile], place]
        new = min(max(old + amount, CLAMP_LOW), CLAMP_HIGH)
        if new != old:
            if indices[tile] == 0 or refs[indices[tile]] != 1:
                make_own(tile, indices, data, refs, free, free_count)
            data[indices[tile], place] = new
            before = fused[tile, place]
            after = before + new - old
            fused[tile, place] = after
            turned = ((before <= FREE) != (after <= FREE)
                      or (before >= OCCUPIED) != (after >= OCCUPIED))
            if turned and tile_version[tile] != version:
                tile_version[tile] = version
                changed[count] = tile
                count += 1
    return count


@lean("b1(i8, i8, i8, i1[:,::1], i2[:,::1])")
def exchange(tile, old, new, data, fused):
    """Put a tile's ``new`` evidence in the place of ``old`` in the sum. Whether a cell became free,
    occupied or unknown. A plain loop, which becomes vector instructions."""
    turned = np.int16(0)
    for c in range(1024):
        before = fused[tile, c]
        after = np.int16(before + np.int16(data[new, c]) - np.int16(data[old, c]))
        turned = np.int16(turned | np.int16(((before <= FREE) ^ (after <= FREE))
                                            | ((before >= OCCUPIED) ^ (after >= OCCUPIED))))
        fused[tile, c] = after
    return turned != 0


@lean("i8(i8, i4[::1], i4[::1], i8, i4[::1], i8[::1], i1[:,::1], i4[::1], i4[::1], i8[::1], "
      "i2[:,::1], i8[::1], i4[::1])")
def replace(sent, tiles, incoming, version, indices, indices_sent, data, refs, free, free_count,
            fused, tile_version, changed):
    """Put ``incoming`` [k] in the place of ``tiles`` [k] of a layer where ``sent`` is newer than
    what is there, and bring the sum up to date. Returns the number of tiles in ``changed``."""
    count = 0
    for k in range(len(tiles)):
        tile = tiles[k]
        if sent <= indices_sent[tile]:
            continue
        indices_sent[tile] = sent
        new, old = incoming[k], indices[tile]
        if new == old:
            continue
        if exchange(tile, old, new, data, fused):
            tile_version[tile] = version
            changed[count] = tile
            count += 1
        if new != 0:
            refs[new] += 1
        drop(old, refs, free, free_count)
        indices[tile] = new
    return count
