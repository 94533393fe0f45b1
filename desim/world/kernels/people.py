"""The social force model of pedestrians and their groups.

Helbing and Molnar, Physical Review E 51, 1995; groups: Moussaid, Perozo, Garnier, Helbing,
Theraulaz, PLoS ONE 5, 2010."""

import math
from typing import NamedTuple

import numpy as np

from desim.ports.kernels import atan2, exp, inner, kernel, types
from desim.world.wall_index import TileIndex

RELAXATION_S = 0.5  # in which a person gets to the wanted velocity
FASTEST = 1.3  # times the wanted speed
PERSON_M2_S2, PERSON_M = 2.1, 0.3  # strength and range of the repulsion by others
STEP_S = 2.0  # ahead of which others are avoided
WALL_M2_S2, WALL_M = 10.0, 0.2  # strength and range of the repulsion by walls
COS_VIEW, BEHIND = -0.17364817766693033, 0.5  # of 100 degrees: what is not in view counts half
REACH_M = 5.0  # beyond it nobody counts: the repulsion is below 1e-6 m/s^2 there
ARRIVED_M = 0.5  # from a way point
# Of groups: who looks back at the others slows down, who is far comes, who is near goes (1/s, and
# m/s^2 twice).
VISION, ATTRACTION, APART = 4.0, 3.0, 1.0
SIDEWAYS = math.pi / 2  # the others are in view up to this angle from the walking direction
NEAR_M = 0.8  # between two of a group

_ROWS = types.Array(types.float64, 2, "C", readonly=True)


class Walkers(NamedTuple):
    """People, and their ways.

    ``places`` [n, 2] m, ``velocities`` [n, 2] m/s, ``wanted`` [n] m/s, ``radius`` m |
    ``offsets`` [n] m to the left of their ways | ``target`` [n] the row of ``points`` that is next,
    ``step`` [n] 1 or -1 to the one behind it, ``first`` and ``last`` [n] rows of their way,
    ``closed`` [n] whether it is a ring | ``yields`` [n] whether robots count as people |
    ``company`` [n, 2] the rows of their group, from the first to before the second |
    ``points`` [p, 2] m, ``normals`` [p, 2] to the left of the way there
    """

    places: np.ndarray
    velocities: np.ndarray
    wanted: np.ndarray
    radius: float
    offsets: np.ndarray
    target: np.ndarray
    step: np.ndarray
    first: np.ndarray
    last: np.ndarray
    closed: np.ndarray
    yields: np.ndarray
    company: np.ndarray
    points: np.ndarray
    normals: np.ndarray


class Barrier(NamedTuple):
    """Walls that people avoid: ``walls`` [n, 4] m, the first ``indexed`` of them in ``tiles``."""

    walls: np.ndarray
    indexed: int
    tiles: TileIndex


_TILES = types.NamedTuple([types.int64[:, ::1], types.int64[::1], types.float64[::1]], TileIndex)
WALKERS = types.NamedTuple(
    [types.float64[:, ::1], types.float64[:, ::1], types.float64[::1], types.float64,
     types.float64[::1], types.int64[::1], types.int64[::1], types.int64[::1], types.int64[::1],
     types.boolean[::1], types.boolean[::1], types.int64[:, ::1], types.float64[:, ::1],
     types.float64[:, ::1]], Walkers)
BARRIER = types.NamedTuple([_ROWS, types.int64, _TILES], Barrier)
_PAIR = types.UniTuple(types.float64, 2)


@inner(types.float64(types.float64, types.float64))
def _length(x, y):
    return math.sqrt(x * x + y * y)


@inner(_PAIR(*[types.float64] * 6))
def _repulsion(rx, ry, vx, vy, ex, ey):
    """The acceleration of a person by another who is (rx, ry) before it, seen from the other, and
    moves at (vx, vy); the person wants to go along (ex, ey). Equations 4, 5 and 8 of the paper: the
    gradient of an ellipse's potential."""
    distance = _length(rx, ry)
    if distance > REACH_M or distance < 1e-9:
        return 0.0, 0.0
    sx, sy = vx * STEP_S, vy * STEP_S
    qx, qy = rx - sx, ry - sy
    other = max(_length(qx, qy), 1e-9)
    axis = 0.5 * math.sqrt(max((distance + other) ** 2 - sx * sx - sy * sy, 1e-8))
    size = PERSON_M2_S2 / PERSON_M * exp(-axis / PERSON_M) * (distance + other) / (4.0 * axis)
    fx, fy = size * (rx / distance + qx / other), size * (ry / distance + qy / other)
    if -(ex * fx + ey * fy) < _length(fx, fy) * COS_VIEW:
        return BEHIND * fx, BEHIND * fy
    return fx, fy


@inner(types.UniTuple(types.float64, 3)(types.float64, types.float64, BARRIER))
def _nearest_wall(x, y, barrier):
    """The way from the nearest point of a wall: distance m, unit vector x, y; inf without one."""
    walls, (start, items, frame) = barrier.walls, barrier.tiles
    row = min(max(int((y - frame[1]) * frame[2]), 0), start.shape[0] - 1)
    col = min(max(int((x - frame[0]) * frame[2]), 0), start.shape[1] - 2)
    best, bx, by = math.inf, 0.0, 0.0
    begin, end = start[row, col], start[row, col + 1]
    for j in range(begin, end + walls.shape[0] - barrier.indexed):
        w = items[j] if j < end else barrier.indexed + j - end
        x1, y1 = walls[w, 0], walls[w, 1]
        ex, ey = walls[w, 2] - x1, walls[w, 3] - y1
        along = min(max(((x - x1) * ex + (y - y1) * ey) / (ex * ex + ey * ey), 0.0), 1.0)
        dx, dy = x - x1 - along * ex, y - y1 - along * ey
        distance = _length(dx, dy)
        if distance < best:
            best, bx, by = distance, dx, dy
    if 0.0 < best < math.inf:
        return best, bx / best, by / best
    return best, 0.0, 0.0


@inner(_PAIR(types.int64, WALKERS))
def _aim(i, people):
    """The direction, a unit vector, to the next way point of person i, which is a new one when it
    has arrived there or come past."""
    for _ in range(2):
        at = people.target[i]
        before = at - people.step[i]
        if people.closed[i] and before < people.first[i]:
            before = people.last[i] - 1
        x = people.points[at, 0] + people.offsets[i] * people.normals[at, 0] - people.places[i, 0]
        y = people.points[at, 1] + people.offsets[i] * people.normals[at, 1] - people.places[i, 1]
        leg_x = people.points[at, 0] - people.points[before, 0]
        leg_y = people.points[at, 1] - people.points[before, 1]
        distance = _length(x, y)
        if distance > ARRIVED_M and x * leg_x + y * leg_y > 0.0:
            return x / distance, y / distance
        if people.closed[i]:
            people.target[i] = people.first[i] + 1 if at == people.last[i] else at + 1
        else:
            if at == people.last[i] or at == people.first[i]:
                people.step[i] = -people.step[i]
            people.target[i] = at + people.step[i]
    distance = max(distance, 1e-9)
    return x / distance, y / distance


@inner(_PAIR(types.int64, WALKERS))
def _company(i, people):
    """The acceleration of person i by the others of its group: by the angle by which the centre of
    them is out of view against its velocity, to the centre of all if that is more than (size - 1) /
    2 m away, and away from each that is near."""
    begin, end = people.company[i]
    x, y = people.places[i]
    vx, vy = people.velocities[i]
    size, cx, cy, fx, fy = end - begin, 0.0, 0.0, 0.0, 0.0
    for j in range(begin, end):
        rx, ry = x - people.places[j, 0], y - people.places[j, 1]
        cx, cy = cx - rx, cy - ry
        apart = _length(rx, ry)
        if 1e-9 < apart < NEAR_M:
            fx, fy = fx + APART * rx / apart, fy + APART * ry / apart
    away = _length(cx, cy) / size
    if away > (size - 1) / 2:
        fx, fy = fx + ATTRACTION * cx / (size * away), fy + ATTRACTION * cy / (size * away)
    hidden = max(atan2(abs(vx * cy - vy * cx), vx * cx + vy * cy) - SIDEWAYS, 0.0)
    return fx - VISION * hidden * vx, fy - VISION * hidden * vy


@kernel(types.void(WALKERS, _ROWS, BARRIER, types.float64))
def walk(people, others, barrier, dt):
    """People walk on for ``dt`` s, among ``others`` [k, 5]: x m, y m, radius m, velocity m/s. A
    step that would come nearer to a wall than the radius, or nearer to one of others that it
    touches, is not made. Their distance from others counts from surface to surface."""
    n = len(people.places)
    forces = np.zeros((n, 2))
    for i in range(n):
        x, y = people.places[i, 0], people.places[i, 1]
        ex, ey = _aim(i, people)
        fx = (people.wanted[i] * ex - people.velocities[i, 0]) / RELAXATION_S
        fy = (people.wanted[i] * ey - people.velocities[i, 1]) / RELAXATION_S
        for j in range(n):
            if j != i:
                px, py = _repulsion(x - people.places[j, 0], y - people.places[j, 1],
                                    people.velocities[j, 0], people.velocities[j, 1], ex, ey)
                fx, fy = fx + px, fy + py
        if people.company[i, 1] - people.company[i, 0] > 1:
            px, py = _company(i, people)
            fx, fy = fx + px, fy + py
        if people.yields[i]:
            for k in range(len(others)):
                rx, ry = x - others[k, 0], y - others[k, 1]
                centres = max(_length(rx, ry), 1e-9)
                gap = max(centres - others[k, 2] - people.radius, 0.01) / centres
                px, py = _repulsion(rx * gap, ry * gap, others[k, 3], others[k, 4], ex, ey)
                fx, fy = fx + px, fy + py
        away, wx, wy = _nearest_wall(x, y, barrier)
        push = WALL_M2_S2 / WALL_M * exp(-away / WALL_M) if away < REACH_M else 0.0
        forces[i, 0], forces[i, 1] = fx + push * wx, fy + push * wy
    for i in range(n):
        vx = people.velocities[i, 0] + forces[i, 0] * dt
        vy = people.velocities[i, 1] + forces[i, 1] * dt
        speed, most = _length(vx, vy), FASTEST * people.wanted[i]
        if speed > most:
            vx, vy = vx * most / speed, vy * most / speed
        x, y = people.places[i, 0], people.places[i, 1]
        if _may_go(i, x + vx * dt, y + vy * dt, people, others, barrier):
            people.places[i, 0], people.places[i, 1] = x + vx * dt, y + vy * dt
        else:
            vx = vy = 0.0
        people.velocities[i, 0], people.velocities[i, 1] = vx, vy


@inner(types.boolean(types.int64, types.float64, types.float64, WALKERS, _ROWS, BARRIER))
def _may_go(i, x, y, people, others, barrier):
    """Whether person i may step to (x, y)."""
    radius = people.radius
    from_x, from_y = people.places[i, 0], people.places[i, 1]
    then = _nearest_wall(x, y, barrier)[0]
    if then < radius and then < _nearest_wall(from_x, from_y, barrier)[0]:
        return False
    for k in range(len(others)):
        then = _length(x - others[k, 0], y - others[k, 1])
        if then < others[k, 2] + radius and \
                then < _length(from_x - others[k, 0], from_y - others[k, 1]):
            return False
    return True
