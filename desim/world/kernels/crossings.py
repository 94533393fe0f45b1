"""Crossings of the straight lines between antennas with walls and blocks."""

import math

from desim.ports.kernels import inner, lean, types

_FIXED = types.Array(types.float64, 2, "C", readonly=True)  # accepts writable arrays too


_OUT = types.Array(types.int64, 2, "C")
# By how much of a tile a line may pass beside it and is still looked for there: far above rounding.
_HAIR = 1e-6


@inner(types.int64(types.int64, types.float64, types.float64))
def _within_tiles(count, at, hair):
    """The tile, of ``count`` in a row, at a place in tiles; of those outside the nearest one."""
    return int(max(0.0, min(count - 1.0, math.floor(at + hair))))


_INDEX = types.int64[:, ::1], types.int64[::1]


@inner(types.int64(types.int64, types.float64[::1], types.float64, _FIXED, types.float64[::1],
                   *_INDEX, _FIXED, types.int64[::1], types.int64[::1]))
def _cross(k, cost, most, walls, frame, start, items, pairs, seen, hits):
    """Write the walls that line ``k`` crosses into ``hits``, ascending; no more of them once their
    ``cost`` [n] together is above ``most``. Returns their number. The rest as in ``crossings``."""
    rows, cols = start.shape[0], start.shape[1] - 1
    px, py = pairs[k, 0], pairs[k, 1]
    dx, dy = pairs[k, 2] - px, pairs[k, 3] - py
    left, right = min(px, px + dx), max(px, px + dx)
    low, high = min(py, py + dy), max(py, py + dy)
    # In tiles: the line from its lower end upwards.
    x, way_x = (px - frame[0]) * frame[2], dx * frame[2]
    y, way_y = (py - frame[1]) * frame[3], dy * frame[3]
    if way_y < 0.0:
        x, y, way_x, way_y = x + way_x, y + way_y, -way_x, -way_y
    slope = way_x / way_y if way_y > 0.0 else 0.0
    first, last = _within_tiles(rows, y, -_HAIR), _within_tiles(rows, y + way_y, _HAIR)
    count, spent = 0, 0.0
    for row in range(first, last + 1):
        begin, end = x, x + way_x  # of the line's part in this row of tiles
        if way_y > 0.0:
            if row > first:
                begin = x + max(row - _HAIR - y, 0.0) * slope
            if row < last:
                end = x + min(row + 1 + _HAIR - y, way_y) * slope
        if end < begin:
            begin, end = end, begin
        begin_col = _within_tiles(cols, begin, -_HAIR)
        end_col = _within_tiles(cols, end, _HAIR)
        for i in range(start[row, begin_col], start[row, end_col + 1]):
            w = items[i]
            if seen[w] == k:
                continue
            seen[w] = k
            x1, y1, x2, y2 = walls[w, 0], walls[w, 1], walls[w, 2], walls[w, 3]
            if max(x1, x2) < left or min(x1, x2) > right:
                continue
            if max(y1, y2) < low or min(y1, y2) > high:
                continue
            side1 = dx * (y1 - py) - dy * (x1 - px)
            side2 = dx * (y2 - py) - dy * (x2 - px)
            ex, ey = x2 - x1, y2 - y1
            side3 = ex * (py - y1) - ey * (px - x1)
            side4 = ex * (py + dy - y1) - ey * (px + dx - x1)
            parallel = side1 == 0.0 and side2 == 0.0
            if side1 * side2 <= 0.0 and side3 * side4 <= 0.0 and not parallel:
                place = count
                while place > 0 and hits[place - 1] > w:
                    hits[place] = hits[place - 1]
                    place -= 1
                hits[place] = w
                count += 1
                spent += cost[w]
                if spent > most:
                    return count
    return count


@lean(types.int64(_FIXED, types.float64[::1], *_INDEX, _FIXED, types.int64[::1], types.int64[::1],
                  types.float64[::1], _OUT))
def crossings(walls, frame, start, items, pairs, seen, hits, free, out):
    """Find the walls that the straight lines between antennas cross, touching included.

    walls [n, 4] m | frame x0 m, y0 m, tiles per m in x and in y | start [rows, cols + 1]: the walls
    that come into tile (row, col) are items[start[row, col]:start[row, col + 1]] | pairs [k, 4] m |
    seen [n] negative, hits [n]: workspace | free [n] zeros | out [capacity, 2] rows (pair, wall),
    sorted
    Returns their number, which may be more than fit.
    Two segments cross when each has its ends on different sides of the other (or on it).
    """
    found = 0
    for k in range(pairs.shape[0]):
        count = _cross(k, free, 1.0, walls, frame, start, items, pairs, seen, hits)
        for i in range(count):
            if found < out.shape[0]:
                out[found, 0] = k
                out[found, 1] = hits[i]
            found += 1
    return found


@lean(types.void(_FIXED, types.float64[::1], *_INDEX, _FIXED, types.int64[::1], types.int64[::1],
                 types.float64[::1], types.float64[::1], types.float64[::1]))
def tolls(walls, frame, start, items, pairs, seen, hits, cost, most, out):
    """Write the ``cost`` [n] of the walls that each line crosses into ``out`` [k]; of a line for
    which it is above ``most`` [k], perhaps of some of them. The rest as in ``crossings``."""
    for k in range(pairs.shape[0]):
        count = _cross(k, cost, most[k], walls, frame, start, items, pairs, seen, hits)
        total = 0.0
        for i in range(count):
            total += cost[hits[i]]
        out[k] = total


@inner(types.int64(_OUT, types.int64, types.int64, types.int64, types.int64, types.int64))
def _crossed(out, found, line, kind, way_in, way_out):
    """Note a stretch of ``kind`` on ``line``: a block's two faces, one of a post's; -1 is none."""
    for face in (way_in, way_out):
        if face >= 0:
            if found < out.shape[0]:
                out[found, 0] = line
                out[found, 1] = face
            found += 1
            if kind % 2 == 1:
                break
    return found


@inner(types.UniTuple(types.float64, 2)(types.float64, types.float64, types.float64, types.float64,
                                       types.float64))
def _within(start, way, width, first, last):
    """The part of [first, last] of a line in which ``start`` + part * ``way`` is in [0, width]."""
    if way == 0.0:
        return (first, last) if 0.0 <= start <= width else (1.0, 0.0)
    one, other = -start / way, (width - start) / way
    return max(first, min(one, other)), min(last, max(one, other))


@lean(types.int64(types.Array(types.int8, 2, "C"), types.Array(types.float64, 2, "C"),
                  types.float64, _OUT))
def stretches(kinds, pairs, gap, out):
    """Find the faces of posts and blocks that lines cross, cell by cell (Amanatides and Woo 1987).

    kinds [rows, cols], 0 free, odd in a post, even in a block | pairs [k, 4] in cells |
    out [capacity, 2] rows (pair, face), by pair; returns their number, which may be more than
    fit. A stretch is of one kind; it goes on behind free cells on a way shorter than ``gap``.

    A face is (side * span + line) * span + place: on which side of its cell it is (0 below, 1
    above, 2 left, 3 right), on which grid line, and where on it. Lines go from left to right.
    """
    rows, cols = kinds.shape
    span = max(rows, cols) + 1
    found = 0
    for k in range(pairs.shape[0]):
        x, y = pairs[k, 0], pairs[k, 1]
        dx, dy = pairs[k, 2] - x, pairs[k, 3] - y
        if dx < 0.0 or dx == 0.0 and dy < 0.0:
            x, y, dx, dy = x + dx, y + dy, -dx, -dy
        at, last = _within(x, dx, cols, 0.0, 1.0)
        at, last = _within(y, dy, rows, at, last)
        if at > last:
            continue
        up = 1 if dy >= 0.0 else -1
        col, row = min(int(x + at * dx), cols - 1), min(int(y + at * dy), rows - 1)
        length = max(math.sqrt(dx * dx + dy * dy), 1e-9)
        kind = kinds[row, col]
        way_in, way_out, left_at = -1, -1, 0.0
        while True:
            next_x = (col + 1 - x) / dx if dx > 0.0 else math.inf
            next_y = (row + (up > 0) - y) / dy if dy != 0.0 else math.inf
            at = min(next_x, next_y)
            here = kinds[row, col]
            if next_x <= next_y:
                col += 1
                leave, enter = (3 * span + col) * span + row, (2 * span + col) * span + row
            else:
                row += up
                line = row + (up < 0)
                leave = ((up > 0) * span + line) * span + col
                enter = ((up < 0) * span + line) * span + col
            if at > last or col >= cols or row < 0 or row >= rows:
                break
            there = kinds[row, col]
            if there == here:
                continue
            if here > 0:
                way_out, left_at = leave, at
            if there > 0:
                if there != kind or (at - left_at) * length >= gap:
                    if kind > 0:
                        found = _crossed(out, found, k, kind, way_in, way_out)
                    kind, way_in = there, enter
                way_out = -1
        if kind > 0:
            found = _crossed(out, found, k, kind, way_in, way_out)
    return found
