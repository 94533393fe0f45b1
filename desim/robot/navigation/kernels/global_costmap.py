"""Loops of the global costmap.

``cost`` is the padded costmap [height + 2, width + 2], or ``flat``, the same as one line: 0..252
free, ``INSCRIBED`` free but too near to an obstacle for the robot's centre, ``LETHAL`` an obstacle,
``UNKNOWN``. The padding is lethal, so that no loop has to test for the rim; it inflates nothing.
A cell is its place in ``flat``, whose rows are ``across`` cells long.
"""

import numpy as np

from desim.ports.kernels import cos, from_dtype, inner, kernel, lean, sin, types
from desim.robot.mapping.kernels.tiles import FREE, OCCUPIED

TILE = 32
INSCRIBED, LETHAL, UNKNOWN = 253, 254, 255

# Where the costmap lies, one record: its lower left corner without the padding, and its cells with
# the padding.
FRAME = np.dtype([(name, "f8") for name in ("x_m", "y_m", "cell_m", "across", "rows")])
FRAME_ARRAY = types.Array(from_dtype(FRAME), 1, "C")


@inner(types.int64(types.float64, types.float64, FRAME_ARRAY))
def place(x, y, frame):
    """The cell of a point, or -1 outside."""
    f = frame[0]
    column, row = (x - f.x_m) / f.cell_m, (y - f.y_m) / f.cell_m
    if 0.0 <= column < f.across - 2 and 0.0 <= row < f.rows - 2:  # so int() is the floor
        return (int(row) + 1) * f.across + int(column) + 1
    return -1


@inner("UniTuple(u1, 4)(i2[::1], u1[::1])")
def reclassify(values, costs):
    """Bring the costs of a row of cells up to date with their log-odds. Returns the first of those
    that changed, one beyond the last, and the same of those that are or were obstacles; 255 and 0
    where there are none. Without a branch: it becomes vector instructions."""
    first, end, first_lethal, end_lethal = np.uint8(255), np.uint8(0), np.uint8(255), np.uint8(0)
    for c in range(len(values)):
        value, old = values[c], costs[c]
        new = old if old <= np.uint8(INSCRIBED) else np.uint8(0)
        new = new if value <= FREE else np.uint8(UNKNOWN)
        new = new if value < OCCUPIED else np.uint8(LETHAL)
        costs[c] = new
        at, beyond = np.uint8(c), np.uint8(c + 1)
        low = at if new != old else np.uint8(255)
        high = beyond if new != old else np.uint8(0)
        is_lethal = np.uint8(old == np.uint8(LETHAL)) | np.uint8(new == np.uint8(LETHAL))
        first, end = min(first, low), max(end, high)
        first_lethal = min(first_lethal, low if is_lethal else np.uint8(255))
        end_lethal = max(end_lethal, high if is_lethal else np.uint8(0))
    return first, end, first_lethal, end_lethal


@lean("i8(i2[:,::1], i8[::1], i4[:,::1], i8, i8, i8, u1[:,::1], i8[:,::1])")
def classify(fused, tile_version, row_version, seen, tiles_x, reach, cost, boxes):
    """Bring cells of tiles newer than ``seen`` up to date, free ones with cost 0 for now.

    fused [tiles, 1024] log-odds | boxes [tiles, 4], out: row, row end, column, column end around
    the cells whose cost is to be found anew: those that changed, and all within ``reach`` of a
    changed obstacle. Returns the number of boxes.
    """
    rows, columns, count = cost.shape[0] - 2, cost.shape[1] - 2, 0
    for tile in range(len(tile_version)):
        if tile_version[tile] <= seen:
            continue
        row0, column0 = tile // tiles_x * TILE + 1, tile % tiles_x * TILE + 1
        low_row, end_row, low_column, end_column = rows + 1, 0, columns + 1, 0
        width = min(TILE, columns + 1 - column0)
        for r in range(row0, min(row0 + TILE, rows + 1)):
            if row_version[tile, r - row0] <= seen:
                continue
            first, end, first_lethal, end_lethal = reclassify(
                fused[tile, (r - row0) * TILE:(r - row0) * TILE + width],
                cost[r, column0:column0 + width])
            if end > 0:
                low_row, end_row = min(low_row, r), max(end_row, r + 1)
                low_column = min(low_column, column0 + np.int64(first))
                end_column = max(end_column, column0 + np.int64(end))
            if end_lethal > 0:
                low_row, end_row = min(low_row, r - reach), max(end_row, r + reach + 1)
                low_column = min(low_column, column0 + np.int64(first_lethal) - reach)
                end_column = max(end_column, column0 + np.int64(end_lethal) + reach)
        if end_row > 0:
            boxes[count, 0], boxes[count, 1] = max(low_row, 1), min(end_row, rows + 1)
            boxes[count, 2], boxes[count, 3] = max(low_column, 1), min(end_column, columns + 1)
            count += 1
    return count


@inner("b1(u1[::1])")
def has_obstacle(line):
    """Whether a cell of the line is lethal."""
    found = np.uint8(0)
    for c in range(len(line)):
        found = np.uint8(found | np.uint8(line[c] == np.uint8(LETHAL)))
    return found != 0


@lean("void(i8[:,::1], i8, i8[:,::1], i8, u1[:,::1])")
def inflate(boxes, count, stencil, reach, cost):
    """The cost of the free cells in ``boxes``: the highest that an obstacle near by gives.

    stencil [k, 3] row offset, column offset, cost <= INSCRIBED | reach: its half width in cells
    """
    for b in range(count):
        row, end_row, column, end_column = boxes[b]
        for r in range(row, end_row):
            line = cost[r, column:end_column]
            for c in range(len(line)):  # without a branch: vector instructions
                line[c] = line[c] if line[c] > np.uint8(INSCRIBED) else np.uint8(0)
        left, right = max(column - reach, 1), min(end_column + reach, cost.shape[1] - 1)
        for r in range(max(row - reach, 1), min(end_row + reach, cost.shape[0] - 1)):
            line = cost[r, left:right]
            if not has_obstacle(line):
                continue
            c = -1
            while c < len(line) - 1:  # ``range`` has twelve instructions a cell here
                c += 1
                if line[np.uint64(c)] != LETHAL:
                    continue
                for k in range(len(stencil)):
                    y, x = r + stencil[k, 0], left + c + stencil[k, 1]
                    if not (row <= y < end_row and column <= x < end_column):
                        continue
                    cell = np.uint64(y), np.uint64(x)
                    cost[cell] = max(cost[cell], np.uint8(stencil[k, 2]))


@inner(types.void(types.float64, types.float64, types.float64, types.float64, types.float64,
                  FRAME_ARRAY, types.uint8[::1]))
def clear_beam(x, y, ahead, left, length_m, frame, flat):
    """Make the cells free that a beam crosses, sampled at half cells, but not the cell of its end.
    """
    end, step_m = place(x + length_m * ahead, y + length_m * left, frame), 0.5 * frame[0].cell_m
    for k in range(int(length_m / step_m) + 1):
        cell = place(x + k * step_m * ahead, y + k * step_m * left, frame)
        if cell >= 0 and cell != end:
            flat[cell] = 0


@lean(types.void(types.float32[::1], types.float64[:, ::1], types.UniTuple(types.float64, 3),
                 types.float64, types.UniTuple(types.float64, 3), FRAME_ARRAY, types.uint8[::1]))
def see(ranges, beams, pose, no_return_m, limits_m, frame, flat):
    """Clear and mark as a scan says, before inflation. ``ranges`` [k] float32 m, with hits below
    ``no_return_m``, and ``beams`` [k, 2] cos and sin of their angles, from ``pose`` x, y, yaw.

    ``limits_m``: the distances from the robot up to which beams clear and hits mark, and the radius
    of the robot, under which all is free
    """
    (x, y, yaw), (clear_m, mark_m, radius_m) = pose, limits_m
    c, s, cell_m = cos(yaw), sin(yaw), frame[0].cell_m
    for b in range(len(ranges)):
        if ranges[b] > 0.0:
            ahead, left = c * beams[b, 0] - s * beams[b, 1], s * beams[b, 0] + c * beams[b, 1]
            clear_beam(x, y, ahead, left, min(float(ranges[b]), clear_m), frame, flat)
    for b in range(len(ranges)):
        r = float(ranges[b])
        if 0.0 < r <= mark_m and r < no_return_m:
            hit = place(x + r * (c * beams[b, 0] - s * beams[b, 1]),
                        y + r * (s * beams[b, 0] + c * beams[b, 1]), frame)
            if hit >= 0:
                flat[hit] = LETHAL
    reach = int(radius_m / cell_m)
    for row in range(-reach, reach + 1):
        for column in range(-reach, reach + 1):
            cell = place(x + column * cell_m, y + row * cell_m, frame)
            if cell >= 0 and (row * row + column * column) * cell_m * cell_m <= radius_m**2:
                flat[cell] = 0


@kernel("b1(u1[::1], i8, i8)", inner=True)
def beside_unknown(flat, across, cell):
    """Whether one of the four neighbours of a cell, which is not of the padding, is unknown."""
    return (flat[np.uint64(cell - 1)] == UNKNOWN or flat[np.uint64(cell + 1)] == UNKNOWN
            or flat[np.uint64(cell - across)] == UNKNOWN
            or flat[np.uint64(cell + across)] == UNKNOWN)


@lean("b1(u1[::1], i8, i8, i8, i8)")
def is_cheap_line(flat, across, a, b, highest):
    """Whether no cost on the straight line between the centres of two cells, sampled at half cells,
    is above ``highest``; that of the cell ``a`` itself does not count."""
    row, column = a // across, a % across
    rows, columns = b // across - row, b % across - column
    steps = 2 * max(abs(rows), abs(columns))
    for k in range(2, steps + 1):
        # Nothing here is below 0, so int() is the floor.
        r, c = int(row + k * rows / steps + 0.5), int(column + k * columns / steps + 0.5)
        if flat[r * across + c] > highest:
            return False
    return True


@lean("i8(u1[::1], i8, i8, i8)")
def nearest_free(flat, across, cell, reach):
    """The cell of a cost below INSCRIBED nearest to ``cell``, at most ``reach`` cells away; of
    equally near ones the cheapest, then the first; -1 if there is none."""
    rows, row, column = len(flat) // across, cell // across, cell % across
    best, near2, lowest = -1, reach * reach + 1, 0
    for r in range(max(row - reach, 1), min(row + reach, rows - 2) + 1):
        for c in range(max(column - reach, 1), min(column + reach, across - 2) + 1):
            cost, d2 = flat[r * across + c], (r - row)**2 + (c - column)**2
            if cost < INSCRIBED and (d2 < near2 or (d2 == near2 and best >= 0 and cost < lowest)):
                best, near2, lowest = r * across + c, d2, cost
    return best


@lean("i8(u1[::1], i8, i8, i8, i8)")
def count_frontier_cells(flat, across, cell, reach, highest):
    """The number of cells of a cost up to ``highest``, in the square of ``reach`` cells around
    ``cell``, that have an unknown one among their four neighbours."""
    rows, row, column, count = len(flat) // across, cell // across, cell % across, 0
    for r in range(max(row - reach, 1), min(row + reach, rows - 2) + 1):
        for c in range(max(column - reach, 1), min(column + reach, across - 2) + 1):
            k = r * across + c
            if flat[k] <= highest and beside_unknown(flat, across, k):
                count += 1
    return count
