"""Bodies in motion: motors, the way driven in a tick, and contacts."""

import math
from typing import NamedTuple

import numpy as np

from desim.ports.kernels import TWO_PI, cos, inner, kernel, lean, sin, types
from desim.world.kernels.contact import BARRIERS, deepest

_f8, _i8, _f8x1, _f8x2 = types.float64, types.int64, types.float64[::1], types.float64[:, ::1]
_i8x1, _i8x2 = types.int64[::1], types.int64[:, ::1]
# Columns of ``limits`` [n, 9] and of ``clocks`` [n, 3].
(RADIUS, SPEED, TURN, ACCELERATION, TURN_ACCELERATION, HOLONOMIC, CLEARANCE, BOTTOM,
 TOP) = range(9)
COMMANDED, TIMEOUT, WALL_CONTACT = range(3)
# Columns of ``before`` [n, 4]: the pose at the start of the tick, and what happened to it since.
X, Y, YAW, MARK = range(4)
UNTOUCHED, PUSHED, PUT_BACK = 0.0, 1.0, 2.0

SLOP_M = 1e-6  # a smaller overlap is none: far above rounding, far below a pose's noise
# Tuned: 20 % less or more of all three changes no run of 60 s of scenarios/maze_8.yaml and
# maze_30.yaml, seeds 1 and 2, with five collisions.
TOLERANCE_M = 0.005  # a larger overlap after ROUNDS: both bodies go back to where the tick began
ROUNDS = 24  # of pushing overlapping bodies apart
EPISODE_NS = 500_000_000  # without contact, after which the next one counts anew (our choice)
NEAR_M = 0.2  # the gap up to which two bodies may be pushed into each other within a tick
PUSHES = 3  # away from walls, in a round: one for each wall of a corner, and one to spare
_STRAIGHT_RAD = 1e-6  # a smaller turn in a tick is none: sin and 1 - cos would lose digits


class BodyArrays(NamedTuple):
    """The state of n bodies.

    ``poses`` [n, 3] x m, y m, yaw rad | ``velocities``, ``commands`` [n, 3] forward, left m/s, turn
    rad/s | ``travelled`` [n] m | ``last`` [n, n] ns, the last contact of two robots | ``episodes``
    [.., 2] of contact that begin in a tick: robot, other or -1 | ``order`` [n] the robots along x,
    as they were a tick ago | ``pairs`` [.., 2] to work in
    """

    poses: np.ndarray
    velocities: np.ndarray
    commands: np.ndarray
    limits: np.ndarray
    clocks: np.ndarray
    before: np.ndarray
    travelled: np.ndarray
    last: np.ndarray
    episodes: np.ndarray
    order: np.ndarray
    pairs: np.ndarray


BODIES = types.NamedTuple([_f8x2, _f8x2, _f8x2, _f8x2, _i8x2, _f8x2, _f8x1, _i8x2, _i8x2, _i8x1,
                           _i8x2], BodyArrays)
FOUND = types.Tuple([_i8, types.boolean])  # number of episodes so far, whether anything was pushed


@inner("void(f8[::1], f8, f8, f8, f8)")
def move(pose, v, u, w, dt_s):
    """Move one pose [3] for dt_s at constant v forward, u left, w turning: an arc, exactly.

    With phi = w dt, the way in the frame of the start is (sin phi, 1 - cos phi) v / w for the
    forward part and (cos phi - 1, sin phi) u / w for the sideward one. Yaw stays in [-pi, pi).
    """
    phi = w * dt_s
    along, across = dt_s, 0.5 * phi * dt_s
    if abs(phi) > _STRAIGHT_RAD:
        along, across = sin(phi) / w, (1.0 - cos(phi)) / w
    x, y = v * along - u * across, v * across + u * along
    c, s = cos(pose[2]), sin(pose[2])
    pose[0] += c * x - s * y
    pose[1] += s * x + c * y
    yaw = pose[2] + phi
    pose[2] = yaw - TWO_PI * math.floor((yaw + math.pi) / TWO_PI)


@lean("void(f8[:,::1], f8[:,::1], f8)")
def move_all(poses, velocities, dt_s):
    """``move`` all poses [n, 3] at velocities [n, 3]. A body at rest is skipped."""
    for r in range(poses.shape[0]):
        v, u, w = velocities[r, 0], velocities[r, 1], velocities[r, 2]
        if v != 0.0 or u != 0.0 or w != 0.0:
            move(poses[r], v, u, w, dt_s)


@inner(types.void(BODIES, _i8, _f8))
def drive(bodies, now_ns, dt_s):
    """Bring velocities nearer to the commands, as fast as the motors can. A command that is older
    than its timeout counts as a stop."""
    velocities, limits, clocks = bodies.velocities, bodies.limits, bodies.clocks
    for r in range(velocities.shape[0]):
        forward, left, turn = bodies.commands[r, 0], bodies.commands[r, 1], bodies.commands[r, 2]
        if now_ns - clocks[r, COMMANDED] > clocks[r, TIMEOUT]:
            forward, left, turn = 0.0, 0.0, 0.0
        if limits[r, HOLONOMIC] == 0.0:
            left = 0.0
        speed = math.sqrt(forward * forward + left * left)
        if speed > limits[r, SPEED]:
            forward *= limits[r, SPEED] / speed
            left *= limits[r, SPEED] / speed
        turn = min(max(turn, -limits[r, TURN]), limits[r, TURN])
        step = limits[r, ACCELERATION] * dt_s
        dv, du = forward - velocities[r, 0], left - velocities[r, 1]
        change = math.sqrt(dv * dv + du * du)
        share = step / change if change > step else 1.0
        v, u = velocities[r, 0] + share * dv, velocities[r, 1] + share * du
        step = limits[r, TURN_ACCELERATION] * dt_s
        w = velocities[r, 2] + min(max(turn - velocities[r, 2], -step), step)
        velocities[r, 0], velocities[r, 1], velocities[r, 2] = v, u, w


@inner(types.void(BODIES, _i8, _f8))
def drive_all(bodies, now_ns, dt_s):
    """Begin a tick: all bodies drive on, whatever is in their way."""
    poses, before = bodies.poses, bodies.before
    for r in range(poses.shape[0]):
        before[r, X], before[r, Y], before[r, YAW] = poses[r, 0], poses[r, 1], poses[r, 2]
        before[r, MARK] = UNTOUCHED
    drive(bodies, now_ns, dt_s)
    move_all(poses, bodies.velocities, dt_s)


@inner(_i8(BODIES))
def near_pairs(bodies):
    """Find robots that may touch, and write them to ``pairs``, robot < other. Returns the number of
    pairs. It sweeps along x over ``order``, which stays sorted from tick to tick."""
    poses, limits, order = bodies.poses, bodies.limits, bodies.order
    n, found, widest = order.shape[0], 0, 0.0
    for i in range(n):
        robot = order[i]
        widest = max(widest, limits[robot, RADIUS])
        j = i
        while j > 0 and poses[order[j - 1], 0] > poses[robot, 0]:
            order[j] = order[j - 1]
            j -= 1
        order[j] = robot
    for i in range(n):
        a = order[i]
        reach = limits[a, RADIUS] + widest + NEAR_M
        for j in range(i + 1, n):
            b = order[j]
            dx = poses[b, 0] - poses[a, 0]
            if dx > reach:
                break
            dy = poses[b, 1] - poses[a, 1]
            touch = limits[a, RADIUS] + limits[b, RADIUS] + NEAR_M
            level = limits[a, BOTTOM] < limits[b, TOP] and limits[b, BOTTOM] < limits[a, TOP]
            if level and dx * dx + dy * dy < touch * touch:
                bodies.pairs[found, 0], bodies.pairs[found, 1] = min(a, b), max(a, b)
                found += 1
    return found


@inner(_i8(BODIES, _i8, _i8, _i8, _i8))
def note_pair(bodies, a, b, now_ns, found):
    """Note a contact of robots a and b. Returns the number of episodes: one more than ``found`` if
    one began."""
    if now_ns - bodies.last[a, b] > EPISODE_NS:
        bodies.episodes[found, 0], bodies.episodes[found, 1] = a, b
        found += 1
    bodies.last[a, b] = now_ns
    return found


@inner(_i8(BODIES, _i8, _i8, _i8))
def note_barrier(bodies, r, now_ns, found):
    """``note_pair``, of robot r and a barrier."""
    if now_ns - bodies.clocks[r, WALL_CONTACT] > EPISODE_NS:
        bodies.episodes[found, 0], bodies.episodes[found, 1] = r, -1
        found += 1
    bodies.clocks[r, WALL_CONTACT] = now_ns
    return found


@inner(FOUND(BODIES, _i8, _i8, _i8))
def part_pairs(bodies, count, now_ns, found):
    """Push overlapping robots apart, each by half, and note the episodes that begin."""
    poses, before, limits = bodies.poses, bodies.before, bodies.limits
    acted = False
    for p in range(count):
        a, b = bodies.pairs[p, 0], bodies.pairs[p, 1]
        dx, dy = poses[b, 0] - poses[a, 0], poses[b, 1] - poses[a, 1]
        distance = math.sqrt(dx * dx + dy * dy)
        overlap = limits[a, RADIUS] + limits[b, RADIUS] - distance
        if overlap <= SLOP_M or distance == 0.0:
            continue
        acted = True
        share = 0.5 * overlap / distance
        poses[a, 0] -= share * dx
        poses[a, 1] -= share * dy
        poses[b, 0] += share * dx
        poses[b, 1] += share * dy
        before[a, MARK] = before[b, MARK] = PUSHED
        found = note_pair(bodies, a, b, now_ns, found)
    return found, acted


@inner(FOUND(BODIES, BARRIERS, _i8, _i8))
def part_from_barriers(bodies, barriers, now_ns, found):
    """Push robots out of barriers, and note the episodes that begin."""
    poses, limits = bodies.poses, bodies.limits
    acted = False
    for r in range(poses.shape[0]):
        for _ in range(PUSHES):
            depth, nx, ny = deepest(poses[r, 0], poses[r, 1], limits[r, RADIUS],
                                    limits[r, CLEARANCE], barriers)
            if depth <= SLOP_M:
                break
            acted = True
            poses[r, 0] += depth * nx
            poses[r, 1] += depth * ny
            bodies.before[r, MARK] = PUSHED
            found = note_barrier(bodies, r, now_ns, found)
    return found, acted


@inner(types.void(BODIES, _i8))
def put_back(bodies, r):
    """Put a robot back to where the tick began: a place that was free."""
    bodies.poses[r, 0], bodies.poses[r, 1] = bodies.before[r, X], bodies.before[r, Y]
    bodies.before[r, MARK] = PUT_BACK


@inner(types.void(BODIES, BARRIERS, _i8))
def undo(bodies, barriers, count):
    """Take back the ticks of robots that no pushing got out of what they overlap."""
    poses, before, limits = bodies.poses, bodies.before, bodies.limits
    acted = True
    while acted:
        acted = False
        for r in range(poses.shape[0]):
            if before[r, MARK] == PUSHED and deepest(
                    poses[r, 0], poses[r, 1], limits[r, RADIUS], limits[r, CLEARANCE],
                    barriers)[0] > TOLERANCE_M:
                put_back(bodies, r)
                acted = True
        for p in range(count):
            a, b = bodies.pairs[p, 0], bodies.pairs[p, 1]
            dx, dy = poses[b, 0] - poses[a, 0], poses[b, 1] - poses[a, 1]
            touch = limits[a, RADIUS] + limits[b, RADIUS] - TOLERANCE_M
            if dx * dx + dy * dy < touch * touch and (
                    before[a, MARK] != PUT_BACK or before[b, MARK] != PUT_BACK):
                put_back(bodies, a)
                put_back(bodies, b)
                acted = True


@inner(types.void(BODIES, _f8))
def settle(bodies, dt_s):
    """Add the way of this tick to ``travelled``, and reduce the velocity of bodies that were pushed
    or put back to that of their actual way."""
    poses, velocities, before = bodies.poses, bodies.velocities, bodies.before
    for r in range(poses.shape[0]):
        x, y = (poses[r, 0] - before[r, X]) / dt_s, (poses[r, 1] - before[r, Y]) / dt_s
        bodies.travelled[r] += math.sqrt(x * x + y * y) * dt_s
        if before[r, MARK] != UNTOUCHED:
            heading = before[r, YAW] + 0.5 * velocities[r, 2] * dt_s
            c, s = cos(heading), sin(heading)
            v, u = velocities[r, 0], velocities[r, 1]
            velocities[r, 0] = min(max(c * x + s * y, min(v, 0.0)), max(v, 0.0))
            velocities[r, 1] = min(max(c * y - s * x, min(u, 0.0)), max(u, 0.0))


@kernel(_i8(BODIES, BARRIERS, _i8, _f8))
def advance(bodies, barriers, now_ns, dt_s):
    """Make one tick of the fleet, ending at ``now_ns``. Returns the number of contact episodes that
    began.

    Contacts are resolved one after the other, in rounds: pairs first, then walls, so that no robot
    ends up in a wall. Robots far away have no part in it, neither in a sum nor in the order.
    """
    drive_all(bodies, now_ns, dt_s)
    count, found, acted = near_pairs(bodies), 0, True
    for _ in range(ROUNDS):
        found, apart = part_pairs(bodies, count, now_ns, found)
        found, acted = part_from_barriers(bodies, barriers, now_ns, found)
        acted = acted or apart
        if not acted:
            break
    if acted:
        undo(bodies, barriers, count)
    settle(bodies, dt_s)
    return found
