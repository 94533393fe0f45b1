"""Bodies in motion: motors, the way driven in a tick, and contacts."""

import math

from desim.ports.kernels import TWO_PI, cos, inner, kernel, lean, sin, types
from desim.world.kernels.contact import RASTER, TILES, deepest

_ROWS = types.Array(types.float64, 2, "C", readonly=True)
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
NEAR_M = 0.2  # the gap up to which two bodies may be pushed into each other within a tick
PUSHES = 3  # away from walls, in a round: one for each wall of a corner, and one to spare
_STRAIGHT_RAD = 1e-6  # a smaller turn in a tick is none: sin and 1 - cos would lose digits


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


@inner("void(f8[:,::1], f8[:,::1], f8[:,::1], i8[:,::1], i8, f8)")
def drive(velocities, commands, limits, clocks, now_ns, dt_s):
    """Bring velocities nearer to the commands, as fast as the motors can. A command that is older
    than its timeout counts as a stop.

    velocities, commands [n, 3] forward, left m/s, turn rad/s
    """
    for r in range(velocities.shape[0]):
        forward, left, turn = commands[r, 0], commands[r, 1], commands[r, 2]
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


@inner("i8(f8[:,::1], f8[:,::1], i8[::1], i8[:,::1])")
def near_pairs(poses, limits, order, pairs):
    """Find robots that may touch, and write them to pairs [.., 2], robot < other. Returns the
    number of pairs. It sweeps along x over ``order`` [n], which stays sorted from tick to tick.
    """
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
                pairs[found, 0], pairs[found, 1] = min(a, b), max(a, b)
                found += 1
    return found


@inner("i8(f8[:,::1], f8[:,::1], f8[:,::1], i8[:,::1], i8, i8[:,::1], i8, i8, i8[:,::1], i8)")
def part_pairs(poses, before, limits, pairs, count, last, now_ns, episode_ns, episodes, found):
    """Push overlapping robots apart, each by half, and note the episodes that begin.

    last [n, n] time ns of the last contact of two robots | episodes [.., 2] filled from ``found``
    Returns the new ``found``, or -1 - ``found`` when nothing overlapped.
    """
    acted = False
    for p in range(count):
        a, b = pairs[p, 0], pairs[p, 1]
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
        if now_ns - last[a, b] > episode_ns:
            episodes[found, 0], episodes[found, 1] = a, b
            found += 1
        last[a, b] = now_ns
    return found if acted else -1 - found


@inner("void(f8[:,::1], f8[:,::1], i8)")
def put_back(poses, before, robot):
    """Put a robot back to where the tick began: a place that was free."""
    poses[robot, 0], poses[robot, 1] = before[robot, X], before[robot, Y]
    before[robot, MARK] = PUT_BACK


@inner("void(f8[:,::1], f8[:,::1], f8[:,::1], f8[::1], f8)")
def settle(poses, velocities, before, travelled, dt_s):
    """Reduce the velocity of bodies that were pushed or put back to that of their actual way.

    travelled [n] m, to which the way of this tick is added
    """
    for r in range(poses.shape[0]):
        x, y = (poses[r, 0] - before[r, X]) / dt_s, (poses[r, 1] - before[r, Y]) / dt_s
        travelled[r] += math.sqrt(x * x + y * y) * dt_s
        if before[r, MARK] != UNTOUCHED:
            heading = before[r, YAW] + 0.5 * velocities[r, 2] * dt_s
            c, s = cos(heading), sin(heading)
            v, u = velocities[r, 0], velocities[r, 1]
            velocities[r, 0] = min(max(c * x + s * y, min(v, 0.0)), max(v, 0.0))
            velocities[r, 1] = min(max(c * y - s * x, min(u, 0.0)), max(u, 0.0))


@kernel(types.int64(*[types.float64[:, ::1]] * 4, types.int64[:, ::1], types.int64[::1],
                    types.int64[:, ::1], types.float64[:, ::1], types.int64[:, ::1],
                    types.float64[::1], _ROWS, types.float64[::1], types.int64, TILES, RASTER,
                    _ROWS, types.int64, types.float64, types.int64, types.int64[:, ::1]))
def advance(poses, velocities, commands, limits, clocks, order, pairs, before, last, travelled,
            walls, tops, indexed, tiles, raster, discs, now_ns, dt_s, episode_ns, episodes):
    """Make one tick of the fleet, ending at ``now_ns``. Returns the number of contact episodes that
    began.

    Contacts are resolved one after the other, in rounds: pairs first, then walls, so that no robot
    ends up in a wall. Robots far away have no part in it, neither in a sum nor in the order.
    """
    n = poses.shape[0]
    for r in range(n):
        before[r, X], before[r, Y], before[r, YAW] = poses[r, 0], poses[r, 1], poses[r, 2]
        before[r, MARK] = UNTOUCHED
    drive(velocities, commands, limits, clocks, now_ns, dt_s)
    move_all(poses, velocities, dt_s)
    count = near_pairs(poses, limits, order, pairs)
    found, acted = 0, True
    for _ in range(ROUNDS):
        if not acted:
            break
        found = part_pairs(poses, before, limits, pairs, count, last, now_ns, episode_ns, episodes,
                           found)
        acted = found >= 0
        found = found if acted else -1 - found
        for r in range(n):
            for _ in range(PUSHES):
                depth, nx, ny = deepest(poses[r, 0], poses[r, 1], limits[r, RADIUS],
                                        limits[r, CLEARANCE], walls, tops, indexed, tiles, raster,
                                        discs)
                if depth <= SLOP_M:
                    break
                acted = True
                poses[r, 0] += depth * nx
                poses[r, 1] += depth * ny
                before[r, MARK] = PUSHED
                if now_ns - clocks[r, WALL_CONTACT] > episode_ns:
                    episodes[found, 0], episodes[found, 1] = r, -1
                    found += 1
                clocks[r, WALL_CONTACT] = now_ns
    while acted:
        acted = False
        for r in range(n):
            if before[r, MARK] == PUSHED and deepest(
                    poses[r, 0], poses[r, 1], limits[r, RADIUS], limits[r, CLEARANCE], walls, tops,
                    indexed, tiles, raster, discs)[0] > TOLERANCE_M:
                put_back(poses, before, r)
                acted = True
        for p in range(count):
            a, b = pairs[p, 0], pairs[p, 1]
            dx, dy = poses[b, 0] - poses[a, 0], poses[b, 1] - poses[a, 1]
            touch = limits[a, RADIUS] + limits[b, RADIUS] - TOLERANCE_M
            if dx * dx + dy * dy < touch * touch and (
                    before[a, MARK] != PUT_BACK or before[b, MARK] != PUT_BACK):
                put_back(poses, before, a)
                put_back(poses, before, b)
                acted = True
    settle(poses, velocities, before, travelled, dt_s)
    return found
