"""Beams against walls, discs and raster cells.

Of each beam the *inverse* range is kept: in the sensor's frame a wall n . p = d seen along the unit
vector u has 1 / range = (n . u) / d, linear in u, so that the nearest wall is a maximum of sums of
two products. Beams of one sweep have ascending angles, hence a wall or disc covers one span of them
(an angular z-buffer).
"""

import math
from typing import NamedTuple

import numpy as np

from desim.ports.kernels import TWO_PI, atan2, cos, inner, lean, normal, sin, types
from desim.world.wall_index import TileIndex

_f8, _i8, _f8x1, _f8x2 = types.float64, types.int64, types.float64[::1], types.float64[:, ::1]
_FIXED = types.Array(_f8, 2, "C", readonly=True)
# Part of the angle between beams by which a span is widened at both ends, far above rounding: no
# beam slips between walls that touch.
_SEAM = 1e-9
# Least cross product (m^2) of a wall's ends: a wall seen from its own line has none, and no inverse
# range. Also the least range in a raster, in cells.
_EDGE_ON = 1e-12
_NEVER = 1e300  # the way to the faces beside a beam that runs along an axis: infinite
# asin(q) <= q pi / 2, and <= 1.05 q up to q = 0.5 (it is 1.047 q there).
_WIDE, _NARROW = 0.5 * math.pi, 1.05


class LaserArrays(NamedTuple):
    """A kind of laser, and what does not move.

    Beam i points to ``angle_min_rad + i * increment_rad`` from the laser's heading, ``directions``
    [2, beams] are its cosine and sine there | the laser's place on the robot ``x_m``, ``y_m``,
    ``yaw_rad`` | ``keys`` [n] of noise | ``inverse`` [beams] 1/m, to work in |
    ``radii`` [n] m of the robots | ``tiles``: index of the terrain's walls, ``indexed`` of them |
    ``squares`` of the raster (``free_squares``) and their ``frame``, x0 m, y0 m, cells per m
    """

    angle_min_rad: float
    increment_rad: float
    reach_m: float
    noise_m: float
    x_m: float
    y_m: float
    yaw_rad: float
    directions: np.ndarray
    keys: np.ndarray
    inverse: np.ndarray
    radii: np.ndarray
    indexed: int
    tiles: TileIndex
    squares: np.ndarray
    frame: np.ndarray


LASER = types.NamedTuple([
    *[_f8] * 7, _f8x2, types.uint64[::1], _f8x1, _f8x1, _i8,
    types.NamedTuple([types.int64[:, ::1], types.int64[::1], _f8x1], TileIndex),
    types.uint8[:, :, ::1], _f8x1], LaserArrays)


class View(NamedTuple):
    """The place of a laser, and the cosine and sine of its heading."""

    x: float
    y: float
    c: float
    s: float


VIEW = types.NamedUniTuple(_f8, 4, View)


@inner(types.void(LASER, VIEW, _FIXED))
def cover_walls(laser, view, walls):
    """Write the walls [n, 4] of the view's tile, and those behind the index, into the beams that
    they cover."""
    start, items, frame = laser.tiles
    row = min(max(int((view.y - frame[1]) * frame[2]), 0), start.shape[0] - 1)
    col = min(max(int((view.x - frame[0]) * frame[2]), 0), start.shape[1] - 2)
    listed = items[start[row, col]:start[row, col + 1]]
    angle_min, per_rad, inverse = laser.angle_min_rad, 1.0 / laser.increment_rad, laser.inverse
    reach2, directions = laser.reach_m * laser.reach_m, laser.directions
    beams, x, y, c, s = inverse.shape[0], view.x, view.y, view.c, view.s
    for j in range(len(listed) + walls.shape[0] - laser.indexed):
        w = listed[j] if j < len(listed) else laser.indexed + j - len(listed)
        dx1, dy1, dx2, dy2 = walls[w, 0] - x, walls[w, 1] - y, walls[w, 2] - x, walls[w, 3] - y
        x1, y1, x2, y2 = c * dx1 + s * dy1, c * dy1 - s * dx1, c * dx2 + s * dy2, c * dy2 - s * dx2
        cross = x1 * y2 - x2 * y1
        ex, ey = x2 - x1, y2 - y1
        if abs(cross) < _EDGE_ON or cross * cross > reach2 * (ex * ex + ey * ey):
            continue
        start_rad, end_rad = atan2(y1, x1), atan2(y2, x2)
        if cross < 0.0:
            start_rad, end_rad = end_rad, start_rad
        laps = 1
        if end_rad < start_rad:  # it passes behind the sensor: two spans, a turn apart
            end_rad += TWO_PI
            laps = 2
        nx, ny = ey / cross, -ex / cross
        for _ in range(laps):
            first = max(math.ceil((start_rad - angle_min) * per_rad - _SEAM), 0)
            last = min(math.floor((end_rad - angle_min) * per_rad + _SEAM), beams - 1)
            for i in range(np.uint64(first), np.uint64(max(last + 1, first))):
                value = nx * directions[0, i] + ny * directions[1, i]
                inverse[i] = value if value > inverse[i] else inverse[i]
            start_rad -= TWO_PI
            end_rad -= TWO_PI


@inner(types.void(LASER, VIEW, _FIXED, _i8, _FIXED))
def cover_discs(laser, view, poses, own, discs):
    """Write other robots than ``own`` and ``discs`` [d, 3] into the beams that they cover. With
    b = u . centre, the range is b - sqrt(b^2 - (d^2 - r^2))."""
    angle_min, per_rad, reach = laser.angle_min_rad, 1.0 / laser.increment_rad, laser.reach_m
    directions, inverse = laser.directions, laser.inverse
    beams, robots = inverse.shape[0], poses.shape[0]
    for j in range(robots + discs.shape[0]):
        if j < robots:
            x, y, radius = poses[j, 0], poses[j, 1], laser.radii[j]
        else:
            x, y, radius = discs[j - robots, 0], discs[j - robots, 1], discs[j - robots, 2]
        dx, dy = x - view.x, y - view.y
        distance2 = dx * dx + dy * dy
        outside = distance2 - radius * radius
        if j == own or outside <= 0.0 or distance2 > (reach + radius) * (reach + radius):
            continue
        px, py = view.c * dx + view.s * dy, view.c * dy - view.s * dx
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


@inner(types.void(LASER, VIEW))
def cover_raster(laser, view):
    """Cast all beams over a raster terrain."""
    frame, directions = laser.frame, laser.directions
    col, row = (view.x - frame[0]) * frame[2], (view.y - frame[1]) * frame[2]
    limit = laser.reach_m * frame[2]
    for i in range(directions.shape[1]):
        ux = view.c * directions[0, i] - view.s * directions[1, i]
        uy = view.s * directions[0, i] + view.c * directions[1, i]
        t = leap(col, row, ux, uy, limit, laser.squares)
        if t < limit:
            laser.inverse[i] = frame[2] / max(t, _EDGE_ON)


@inner(types.void(LASER, types.uint64, types.uint64, types.float32[::1]))
def read_ranges(laser, key, first, out):
    """Turn inverse ranges into readings [beams]. A beam that met nothing reads ``reach_m``, without
    noise."""
    inverse, reach = laser.inverse, laser.reach_m
    none = 1.0 / reach
    for i in range(inverse.shape[0]):
        out[i] = 1.0 / inverse[i] if inverse[i] > none else reach
    if laser.noise_m > 0.0:
        for i in range(inverse.shape[0]):
            if inverse[i] > none:
                noisy = 1.0 / inverse[i] + laser.noise_m * normal(key, first + np.uint64(i))
                out[i] = min(max(noisy, 0.0), reach)


@inner(VIEW(LASER, _FIXED, _i8))
def view_of(laser, poses, r):
    """The view of the laser on robot r."""
    x, y = poses[r, 0], poses[r, 1]
    c, s = cos(poses[r, 2]), sin(poses[r, 2])
    if laser.x_m != 0.0 or laser.y_m != 0.0:
        x, y = x + c * laser.x_m - s * laser.y_m, y + s * laser.x_m + c * laser.y_m
    if laser.yaw_rad != 0.0:
        c, s = cos(poses[r, 2] + laser.yaw_rad), sin(poses[r, 2] + laser.yaw_rad)
    return View(x, y, c, s)


@lean(types.void(LASER, _FIXED, types.int64[::1], _i8, _FIXED, _FIXED, types.float32[:, ::1]))
def scan(laser, poses, robots, tick, walls, discs, out):
    """Cast sweep number ``tick`` of each of ``robots`` [k].

    poses [n, 3] | walls [w, 4] m, those of the index first and then closed doors | discs [d, 3]
    x, y, radius m of moving ones | out [k, beams] m
    """
    for k in range(robots.shape[0]):
        r = robots[k]
        view = view_of(laser, poses, r)
        laser.inverse[:] = 1.0 / laser.reach_m
        if laser.squares.shape[1] > 0:
            cover_raster(laser, view)
        cover_walls(laser, view, walls)
        cover_discs(laser, view, poses, r, discs)
        first = np.uint64(tick) * np.uint64(laser.inverse.shape[0])
        read_ranges(laser, laser.keys[r], first, out[k])
