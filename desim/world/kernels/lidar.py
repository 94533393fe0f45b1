"""Beams against walls, discs and raster cells.

Of each beam the *inverse* range is kept: in the sensor's frame a wall n . p = d seen along the unit
vector u has 1 / range = (n . u) / d, linear in u, so that the nearest wall is a maximum of sums of
two products. Beams of one sweep have ascending angles, hence a wall or disc covers one span of them
(an angular z-buffer).
"""

import math

import numpy as np

from desim.ports.kernels import TWO_PI, atan2, cos, inner, kernel, lean, normal, sin, types

_FIXED = types.Array(types.float64, 2, "C", readonly=True)
_RADII = types.Array(types.float64, 1, "A", readonly=True)
# Part of the angle between beams by which a span is widened at both ends, far above rounding: no
# beam slips between walls that touch.
_SEAM = 1e-9
# Least cross product (m^2) of a wall's ends: a wall seen from its own line has none, and no inverse
# range. Also the least range in a raster, in cells.
_EDGE_ON = 1e-12
_NEVER = 1e300  # the way to the faces beside a beam that runs along an axis: infinite
# asin(q) <= q pi / 2, and <= 1.05 q up to q = 0.5 (it is 1.047 q there).
_WIDE, _NARROW = 0.5 * math.pi, 1.05


@inner(types.void(_FIXED, types.int64[::1], types.float64, types.float64, types.float64,
                  types.float64, types.float64[::1], types.float64[:, ::1], types.float64[::1]))
def cover_walls(walls, listed, x, y, c, s, laser, directions, inverse):
    """Write the ``listed`` rows of walls [n, 4] into the beams that they cover.

    x, y, c, s the sensor's place and the cosine and sine of its heading | laser as in ``scan`` |
    directions [2, beams] cos, sin | inverse [beams] 1/m, raised where a wall is nearer
    """
    angle_min, per_rad, reach2 = laser[0], 1.0 / laser[1], laser[2] * laser[2]
    beams = inverse.shape[0]
    for w in listed:
        dx1, dy1, dx2, dy2 = walls[w, 0] - x, walls[w, 1] - y, walls[w, 2] - x, walls[w, 3] - y
        x1, y1, x2, y2 = c * dx1 + s * dy1, c * dy1 - s * dx1, c * dx2 + s * dy2, c * dy2 - s * dx2
        cross = x1 * y2 - x2 * y1
        ex, ey = x2 - x1, y2 - y1
        if abs(cross) < _EDGE_ON or cross * cross > reach2 * (ex * ex + ey * ey):
            continue
        start, end = atan2(y1, x1), atan2(y2, x2)
        if cross < 0.0:
            start, end = end, start
        laps = 1
        if end < start:  # it passes behind the sensor: two spans, a turn apart
            end += TWO_PI
            laps = 2
        nx, ny = ey / cross, -ex / cross
        for _ in range(laps):
            first = max(math.ceil((start - angle_min) * per_rad - _SEAM), 0)
            last = min(math.floor((end - angle_min) * per_rad + _SEAM), beams - 1)
            for i in range(first, last + 1):
                value = nx * directions[0, i] + ny * directions[1, i]
                inverse[i] = value if value > inverse[i] else inverse[i]
            start -= TWO_PI
            end -= TWO_PI


@inner(types.void(_FIXED, _RADII, types.int64, types.float64, types.float64,
                  types.float64, types.float64, types.float64[::1], types.float64[:, ::1],
                  types.float64[::1]))
def cover_discs(centres, radii, without, x, y, c, s, laser, directions, inverse):
    """Write discs into the beams that they cover. With b = u . centre, the range is
    b - sqrt(b^2 - (d^2 - r^2)).

    centres [n, >= 2] m | radii [n] m | without: the sensor's own disc, or -1
    """
    angle_min, per_rad, reach = laser[0], 1.0 / laser[1], laser[2]
    beams = inverse.shape[0]
    for j in range(centres.shape[0]):
        dx, dy, radius = centres[j, 0] - x, centres[j, 1] - y, radii[j]
        distance2 = dx * dx + dy * dy
        outside = distance2 - radius * radius
        if j == without or outside <= 0.0 or distance2 > (reach + radius) * (reach + radius):
            continue
        px, py = c * dx + s * dy, c * dy - s * dx
        distance = math.sqrt(distance2)
        nearest = 1.0 / (distance - radius)
        # Half the angle of the disc, or a little more: the beams too many miss.
        half = (_NARROW if distance > 2.0 * radius else _WIDE) * radius / distance
        bearing = atan2(py, px)
        turn = -TWO_PI if bearing > 0.0 else TWO_PI
        for _ in range(2 if abs(bearing) + half > math.pi else 1):
            first = max(math.ceil((bearing - half - angle_min) * per_rad), 0)
            last = min(math.floor((bearing + half - angle_min) * per_rad), beams - 1)
            for i in range(first, last + 1):
                if inverse[i] < nearest:
                    b = directions[0, i] * px + directions[1, i] * py
                    square = b * b - outside
                    if square >= 0.0 and b > 0.0:
                        value = 1.0 / (b - math.sqrt(square))
                        inverse[i] = value if value > inverse[i] else inverse[i]
            bearing += turn


@lean("void(b1[:,::1], u1[:,:,::1])")
def free_squares(solid, squares):
    """Find the free squares over which beams can leap: squares [4, rows, cols] is the side, in
    cells and at most 255, of the largest square of free cells with its corner here that opens to
    quadrant k.

    solid [rows, cols] with a solid border | k = 1 if to the east + 2 if to the north
    The side is one more than the smallest of its three neighbours' in the quadrant.
    """
    rows, cols = solid.shape
    for k in range(4):
        dx, dy = 2 * (k & 1) - 1, (k & 2) - 1
        for i in range(1, rows - 1):
            row = rows - 1 - i if dy > 0 else i
            for j in range(1, cols - 1):
                col = cols - 1 - j if dx > 0 else j
                if not solid[row, col]:
                    least = min(squares[k, row + dy, col], squares[k, row, col + dx],
                                squares[k, row + dy, col + dx])
                    squares[k, row, col] = min(least, 254) + 1


@inner("f8(f8, f8, f8, f8, f8, u1[:,:,::1])")
def leap(x, y, ux, uy, limit, squares):
    """Range to the first solid cell along a beam, exact, in cells; ``limit`` if there is none.

    x, y start | ux, uy unit vector | squares of ``free_squares``: the beam leaps to the face where
    it leaves the free square that opens in its direction
    """
    col, row = int(x), int(y)
    east, north = ux > 0.0, uy > 0.0
    per_x = 1.0 / ux if ux != 0.0 else -_NEVER
    per_y = 1.0 / uy if uy != 0.0 else -_NEVER
    k = (1 if east else 0) + (2 if north else 0)
    t = 0.0
    side = np.int64(squares[k, row, col])
    while side > 0 and t < limit:
        face_x = col + side if east else col - side + 1
        face_y = row + side if north else row - side + 1
        to_x, to_y = (face_x - x) * per_x, (face_y - y) * per_y
        # Rounding may put the other coordinate a hair outside of the square: it is kept inside.
        if to_x < to_y:
            t = to_x
            at = int(y + t * uy)
            row = min(max(at, row), face_y - 1) if north else max(min(at, row), face_y)
            col = face_x if east else face_x - 1
        else:
            t = to_y
            at = int(x + t * ux)
            col = min(max(at, col), face_x - 1) if east else max(min(at, col), face_x)
            row = face_y if north else face_y - 1
        side = np.int64(squares[k, row, col])
    return min(t, limit)


@inner("void(f8, f8, f8, f8, f8, f8[:,::1], u1[:,:,::1], f8[::1], f8[::1])")
def cover_raster(x, y, c, s, reach, directions, squares, frame, inverse):
    """Cast all beams over a raster terrain; frame x0 m, y0 m, cells per m."""
    col, row = (x - frame[0]) * frame[2], (y - frame[1]) * frame[2]
    limit = reach * frame[2]
    for i in range(inverse.shape[0]):
        ux = c * directions[0, i] - s * directions[1, i]
        uy = s * directions[0, i] + c * directions[1, i]
        t = leap(col, row, ux, uy, limit, squares)
        if t < limit:
            inverse[i] = frame[2] / max(t, _EDGE_ON)


@inner("void(f8[::1], f8, f8, u8, u8, f4[::1])")
def read_ranges(inverse, reach, noise_m, key, first, out):
    """Turn inverse ranges into readings [beams]. A beam that met nothing reads ``reach``, without
    noise."""
    none = 1.0 / reach
    for i in range(inverse.shape[0]):
        out[i] = 1.0 / inverse[i] if inverse[i] > none else reach
    if noise_m > 0.0:
        for i in range(inverse.shape[0]):
            if inverse[i] > none:
                noisy = 1.0 / inverse[i] + noise_m * normal(key, first + np.uint64(i))
                out[i] = min(max(noisy, 0.0), reach)


@kernel(types.void(_FIXED, types.int64[::1], types.int64, types.float64[::1], _FIXED,
                   types.float64[:, ::1], types.int64[:, ::1], types.int64[::1], types.float64[::1],
                   types.uint8[:, :, ::1], types.float64[::1], _FIXED, types.float64[::1],
                   types.uint64[::1], types.float64[::1], types.float32[:, ::1]))
def scan(poses, robots, tick, radii, walls, directions, tile_start, tile_items, tile_frame,
         squares, squares_frame, discs, laser, keys, inverse, out):
    """Cast sweep number ``tick`` of each of ``robots`` [k].

    poses [n, 3] | radii [n] m | walls [w, 4] m, those of the index first and then closed doors |
    directions [2, beams] in the sensor's frame | tile_* index of walls | squares of a raster,
    [4, 0, 0] where there is none, and their frame | discs [d, 3] x, y, radius m of moving ones |
    laser: angle_min rad, increment rad, reach m, noise m, number of walls in the index, and its
    place on the robot: x m, y m, yaw rad |
    keys [n] of noise | inverse [beams] scratch | out [k, beams] m
    """
    rows, cols = tile_start.shape[0], tile_start.shape[1] - 1
    doors = np.arange(int(laser[4]), walls.shape[0])
    for k in range(robots.shape[0]):
        r = robots[k]
        x, y = poses[r, 0], poses[r, 1]
        c, s = cos(poses[r, 2]), sin(poses[r, 2])
        if laser[5] != 0.0 or laser[6] != 0.0:
            x, y = x + c * laser[5] - s * laser[6], y + s * laser[5] + c * laser[6]
        if laser[7] != 0.0:
            c, s = cos(poses[r, 2] + laser[7]), sin(poses[r, 2] + laser[7])
        inverse[:] = 1.0 / laser[2]
        if squares.shape[1] > 0:
            cover_raster(x, y, c, s, laser[2], directions, squares, squares_frame, inverse)
        col = min(max(int((x - tile_frame[0]) * tile_frame[2]), 0), cols - 1)
        row = min(max(int((y - tile_frame[1]) * tile_frame[2]), 0), rows - 1)
        listed = tile_items[tile_start[row, col]:tile_start[row, col + 1]]
        cover_walls(walls, listed, x, y, c, s, laser, directions, inverse)
        cover_walls(walls, doors, x, y, c, s, laser, directions, inverse)
        cover_discs(poses, radii, r, x, y, c, s, laser, directions, inverse)
        cover_discs(discs, discs[:, 2], -1, x, y, c, s, laser, directions, inverse)
        first = np.uint64(tick) * np.uint64(inverse.shape[0])
        read_ranges(inverse, laser[2], laser[3], keys[r], first, out[k])
