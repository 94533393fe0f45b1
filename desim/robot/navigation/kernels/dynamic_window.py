"""Loops of the local planner: the dynamic window.

``near2``, ``layer`` and ``scan`` are the local costmap, ``flat`` and ``frame`` the global one, and
``cover`` the footprint; the loops of each say more. ``setup`` and ``state`` are one record each. A
pose is in the local costmap's frame where nothing else is said. Arrays are plain arguments for the
reason given there.
"""

import math

import numpy as np

from desim.ports.kernels import atan2, cos, exp, from_dtype, inner, kernel, lean, sin, types
from desim.robot.navigation.kernels.footprint import (
    body_clearance2,
    least_clearance2,
    turn_is_clear,
)
from desim.robot.navigation.kernels.global_costmap import FRAME_ARRAY, INSCRIBED, LETHAL, place
from desim.robot.navigation.kernels.local_costmap import LAYER_ARRAY, SCAN_ARRAY, clearance2

SETUP = np.dtype([(name, "f8") for name in (
    "max_speed_mps", "max_turn_radps", "turn_acceleration_radps2",
    "speed_step_mps", "turn_step_radps",  # the most that changes in one control period
    "rollout_s", "radius_m", "safe_m",  # the inscribed radius, and what is kept clear around it
    "around_m", "yield_m",  # the same of the circumscribed one
    "behind_m",  # how far the body reaches back
    "inflation_m", "inflation_scaling",
    "cell_m", "look_ahead_m", "keep_right_m", "path_weight", "goal_weight", "obstacle_weight")]
    + [("speeds", "i8"), ("turns", "i8")])  # numbers of samples
# In: the pose on the map and the velocity. In and out: the present leg of the path. Out: the
# velocity to have next, 1.0 if the robot is blocked, and the length of the rest of the path.
STATE = np.dtype([(name, "f8") for name in ("x_m", "y_m", "yaw_rad", "speed_mps", "turn_radps")]
                 + [("leg", "i8")]
                 + [(name, "f8") for name in ("next_mps", "next_radps", "blocked", "togo_m")])

# Tuned, but for the first; ``maze_8`` as in desim/robot/navigation/__init__.py.
# Distance ahead of a rollout's end of the point by which it is judged (dwa_local_planner,
# forward_point_distance).
_ALIGN_M = 0.325
# Distance between the tested points of a rollout: obstacles, with the robot's size, are wider;
# maze_8: 200, 174 s.
_STEP_M = 0.15
_FAN_RAD = math.pi / 12.0  # between directions to try where the way is blocked; maze_8: 189, 195 s
_FAN = 11  # directions on either side, all around; maze_8 with 9: 193 s, 13: same
_FAN_M = 1.5  # the length of way to try in each of them; maze_8: 197, 197 s
_RIGHT = 1.2  # preference for passing on the right, relative to the left; maze_8: 176, 192 s
_FORWARD_M = 0.2  # least progress of a move that counts as one; maze_8: 208, 170 s
_ESCAPE_M = 0.3  # the way out of a place that is too near to an obstacle; maze_8: 203, 205 s
# Turn rate that limits the speed towards a near aim; maze_8: 185, 189 s.
_ARC_RADPS = 1.5
_AIMS = 4  # points ahead on the way that are tried, from far to near; maze_8 with 3: 208 s, 5: 201
# Time to react and brake: 0.3 s + v / 2a at 1.2 m/s and 2.5 m/s^2; maze_8: 184, 188 s.
_YIELD_S = 0.55
# Least speed while yielding, or two robots would wait for each other; maze_8: 208, 202 s.
_CREEP_MPS = 0.15
_TURN_FIRST_RAD = 1.0  # least angle of the way ahead to turn on the spot; maze_8: 194, 200 s
_SLOW_MPS = 0.3  # highest speed at which such a turn begins; maze_8: 186, 206 s
_BACK_MPS = 0.1  # of a polygon that can do nothing else (TrajectoryPlannerROS, escape_vel)
_GENTLE = 0.8  # share of the deceleration that turning on the spot counts on; maze_8: 187, 183 s

_setup, _state = types.Array(from_dtype(SETUP), 1, "C"), types.Array(from_dtype(STATE), 1, "C")
_f8, _f4x2, _u1x1 = types.float64, types.float32[:, ::1], types.uint8[::1]
_f8x1, _f8x2 = _f8[::1], _f8[:, ::1]


@inner(_f8(_f8x2, _state))
def locate(way, state):
    """Move on to the leg of ``way`` [n, 2] that is nearest to the robot, among the present one and
    the next few. Returns the share of it that lies behind."""
    last, best2, along, first = len(way) - 1, np.inf, 1.0, state[0].leg
    x, y = state[0].x_m, state[0].y_m
    for k in range(first, min(first + 4, last)):
        dx, dy = way[k + 1, 0] - way[k, 0], way[k + 1, 1] - way[k, 1]
        length2 = dx * dx + dy * dy
        t = ((x - way[k, 0]) * dx + (y - way[k, 1]) * dy) / length2 if length2 > 0.0 else 1.0
        t = min(max(t, 0.0), 1.0)
        d2 = (way[k, 0] + t * dx - x)**2 + (way[k, 1] + t * dy - y)**2
        if d2 < best2:
            best2, state[0].leg, along = d2, k, t
    return along


@inner("UniTuple(f8, 3)(f8[:,::1], i8, f8, f8, f8)")
def ahead(way, leg, along, ahead_m, right_m):
    """The point of ``way`` that is ``ahead_m`` further on, moved to the right by ``right_m``; near
    the end of the way, the end itself. And the length still to go."""
    last, togo, found = len(way) - 1, 0.0, False
    px, py = way[last, 0], way[last, 1]
    for k in range(leg, last):
        dx, dy = way[k + 1, 0] - way[k, 0], way[k + 1, 1] - way[k, 1]
        length, done = math.sqrt(dx * dx + dy * dy), along if k == leg else 0.0
        rest = (1.0 - done) * length
        if not found and togo + rest > ahead_m:
            found, t = True, done + (ahead_m - togo) / length
            px = way[k, 0] + t * dx + right_m * dy / length
            py = way[k, 1] + t * dy - right_m * dx / length
        togo += rest
    return px, py, togo


@inner(types.boolean(_u1x1, FRAME_ARRAY, _f8, _f8, _f8, _f8))
def clear_line(flat, frame, x, y, px, py):
    """Whether no known obstacle is on the line from one point of the map to another, nor its
    margin, unless the line begins in one."""
    start = place(x, y, frame)
    in_margin = start >= 0 and flat[start] == INSCRIBED
    return line_below(flat, frame, x, y, px, py, LETHAL if in_margin else INSCRIBED)


@inner(types.boolean(_u1x1, FRAME_ARRAY, _f8, _f8, _f8, _f8, types.int64))
def line_below(flat, frame, x, y, px, py, bar):
    """Whether no cell on the line has a cost from ``bar`` to that of an obstacle."""
    steps = int(2.0 * math.sqrt((px - x)**2 + (py - y)**2) / frame[0].cell_m) + 1
    for k in range(1, steps + 1):
        cell = place(x + (px - x) * k / steps, y + (py - y) * k / steps, frame)
        if cell >= 0 and bar <= flat[cell] <= LETHAL:
            return False
    return True


@inner(types.UniTuple(_f8, 3)(_f8x2, _state, _setup, _u1x1, FRAME_ARRAY))
def aim(way, state, setup, flat, frame):
    """The point of the map to steer for, as far ahead and to the right as the line to it is clear;
    and the length still to go."""
    along = locate(way, state)
    for k in range(_AIMS):
        far_m = setup[0].look_ahead_m * (_AIMS - k) / _AIMS
        for right_m in (setup[0].keep_right_m, 0.0):
            px, py, togo = ahead(way, state[0].leg, along, far_m, right_m)
            if clear_line(flat, frame, state[0].x_m, state[0].y_m, px, py):
                return px, py, togo
    return px, py, togo


@inner(_f8(_f4x2, _setup, _f8x2, *[_f8] * 3))
def required2(near2, setup, cover, x, y, yaw):
    """The squared distance from obstacles that a robot at this pose has to keep at first. If it is
    too near to one already, it may approach by half a cell of the layer in each period, but not
    where half a cell more would be a collision."""
    s, slack_m = setup[0], 0.5 * setup[0].cell_m
    near_m = math.sqrt(body_clearance2(near2, s.cell_m, cover, x, y, yaw))
    return min(s.safe_m, max(near_m - slack_m, min(near_m, s.radius_m + slack_m)))**2


@inner("f8(f4[:,::1], f8[:,::1], f8, f8, f8, f8, f8, f8, f8, f8, f8)")
def free_m(near2, cover, cell_m, safe_m, first2, x, y, ux, uy, yaw, length_m):
    """The distance that the robot could go straight ahead, up to ``length_m``, keeping the root of
    ``first2`` at first and ``safe_m`` from there on."""
    for k in range(1, int(length_m / cell_m) + 1):
        bar = first2 if k * cell_m <= _ESCAPE_M else safe_m**2
        px, py = x + k * cell_m * ux, y + k * cell_m * uy
        if body_clearance2(near2, cell_m, cover, px, py, yaw) < bar:
            return (k - 1) * cell_m
    return length_m


@inner(types.UniTuple(_f8, 3)(_f4x2, _setup, _f8x2, *[_f8] * 5))
def around(near2, setup, cover, x, y, yaw, dx, dy):
    """The offset (dx, dy) by which the robot gets to its aim, and 1.0 if it is shut in. If an
    obstacle is in between, it is the straight move that brings the robot forward most, on the right
    side rather than on the left; if none does, it is the longest move."""
    length, cell_m, safe_m = math.sqrt(dx * dx + dy * dy), setup[0].cell_m, setup[0].safe_m
    if length < cell_m:
        return dx, dy, 0.0
    first2, reach = required2(near2, setup, cover, x, y, yaw), min(length, _FAN_M)
    aim_yaw = atan2(dy, dx) if len(cover) > 0 else 0.0  # a disc does not mind
    best, best_x, best_y = 0.0, dx, dy
    for k in range(2 * _FAN + 1):
        angle = (k + 1) // 2 * _FAN_RAD * (-1.0 if k % 2 == 1 else 1.0)
        c, s = cos(angle), sin(angle)
        ux, uy = (c * dx - s * dy) / length, (s * dx + c * dy) / length
        free = free_m(near2, cover, cell_m, safe_m, first2, x, y, ux, uy, aim_yaw + angle, reach)
        if k == 0 and free == reach:
            return dx, dy, 0.0
        forward = free * c * (_RIGHT if angle < 0.0 else 1.0)
        if forward < _FORWARD_M:
            forward = 0.1 * free if free > _ESCAPE_M else 0.0
        if forward > best:
            best, best_x, best_y = forward, free * ux, free * uy
    return best_x, best_y, 1.0 if best == 0.0 else 0.0


@inner(types.void(_setup, *[_f8] * 3, _f8x2))
def fan(setup, yaw, low_w, high_w, arcs):
    """Write the samples of turn rates within reach, and the shape of each one's arc, which is the
    same at any speed.

    ``arcs`` [turns + 1, 6], out: turn rate | chord over arc length | direction of the chord |
    direction of its end. The first is straight on, or as straight as can be.
    """
    s, turns = setup[0], len(arcs) - 1
    for j in range(turns + 1):
        w = low_w + (high_w - low_w) * (j - 1) / (turns - 1) if j else min(max(0.0, low_w), high_w)
        half = 0.5 * w * s.rollout_s
        arcs[j, 0], arcs[j, 1] = w, sin(half) / half if abs(half) > 1e-6 else 1.0
        arcs[j, 2], arcs[j, 3] = cos(yaw + half), sin(yaw + half)
        arcs[j, 4], arcs[j, 5] = cos(yaw + 2.0 * half), sin(yaw + 2.0 * half)


@inner(_f8(_setup, _f8, _f8x1, _f8, _f8))
def path_and_goal_cost(setup, v, arc, lx, ly):
    """The cost of an arc of speed v without obstacles. It is ``path_weight`` times the distance of
    its end from the straight line to the aim, which is (lx, ly) away, plus ``goal_weight`` times
    the distance of a point ahead of its end from the aim."""
    s = setup[0]
    chord_m = v * s.rollout_s * arc[1]
    dx, dy = chord_m * arc[2], chord_m * arc[3]
    fx, fy = dx + _ALIGN_M * arc[4] - lx, dy + _ALIGN_M * arc[5] - ly
    off_m = abs(lx * dy - ly * dx) / (math.sqrt(lx * lx + ly * ly) + 1e-9)
    return s.path_weight * off_m + s.goal_weight * math.sqrt(fx * fx + fy * fy)


@inner(_f8(_f4x2, _setup, *[_f8] * 6))
def obstacle_cost(near2, setup, x, y, yaw, v, w, first2):
    """The cost of an arc of a disc by the least distance from obstacles on it. The robot's present
    place counts, as in TrajectoryPlannerROS, so that standing too near to an obstacle has a cost,
    too. The cost is infinite if the arc comes nearer than the root of ``first2`` at first, or than
    ``safe_m`` later."""
    s = setup[0]
    steps = int(v * s.rollout_s / _STEP_M) + 1
    turn, step_m = w * s.rollout_s / steps, v * s.rollout_s / steps
    c, si, ux, uy = cos(turn), sin(turn), cos(yaw + 0.5 * turn), sin(yaw + 0.5 * turn)
    low2 = min(s.inflation_m**2, clearance2(near2, s.cell_m, x, y))
    for k in range(steps if v > 0.0 else 0):
        x, y = x + step_m * ux, y + step_m * uy
        ux, uy = ux * c - uy * si, uy * c + ux * si
        d2 = clearance2(near2, s.cell_m, x, y)
        if d2 < (first2 if (k + 1) * step_m <= _ESCAPE_M else s.safe_m**2):
            return np.inf
        low2 = min(low2, d2)
    return inflated(setup, low2)


@inner(_f8(_f4x2, _setup, _f8x2, *[_f8] * 6))
def footprint_cost(near2, setup, cover, x, y, yaw, v, w, first2):
    """``obstacle_cost`` of a polygon, whose corners also move when it turns: poses are so near to
    each other that no corner moves farther between two of them than a disc does."""
    s = setup[0]
    way_m = max(abs(v), abs(w) * s.around_m) * s.rollout_s
    steps = int(way_m / _STEP_M) + 1
    low2 = least_clearance2(near2, s.cell_m, cover, x, y, yaw, v, w, s.rollout_s, steps,
                       int(_ESCAPE_M * steps / (way_m + 1e-9)), first2, s.safe_m**2)
    if low2 < 0.0:
        return np.inf
    here2 = body_clearance2(near2, s.cell_m, cover, x, y, yaw)
    return inflated(setup, min(low2, s.inflation_m**2, here2))


@inner(_f8(_setup, _f8))
def inflated(setup, low2):
    """``obstacle_weight`` times the cost that costmap_2d's inflation has at the root of ``low2``
    from an obstacle."""
    s = setup[0]
    if low2 >= s.inflation_m**2:
        return 0.0
    near = exp(-s.inflation_scaling * (math.sqrt(low2) - s.safe_m))
    return s.obstacle_weight * 252.0 * min(near, 1.0)


@kernel(types.void(_f4x2, _setup, _f8x2, _state, *[_f8] * 6), inner=True)
def window(near2, setup, cover, state, x, y, yaw, top_v, aim_x, aim_y):
    """The dynamic window (Fox, Burgard, Thrun 1997): of all velocities within reach in one control
    period, take the one with the cheapest rollout, or brake straight ahead if none is clear."""
    s, out, v, w = setup[0], state[0], state[0].speed_mps, state[0].turn_radps
    low_v, high_v = max(v - s.speed_step_mps, 0.0), min(v + s.speed_step_mps, s.max_speed_mps)
    high_v = max(min(high_v, top_v), low_v)
    low_w = max(w - s.turn_step_radps, -s.max_turn_radps)
    high_w = min(w + s.turn_step_radps, s.max_turn_radps)
    first2 = required2(near2, setup, cover, x, y, yaw)
    best, arcs = np.inf, np.empty((s.turns + 1, 6))
    fan(setup, yaw, low_w, high_w, arcs)
    out.next_mps, out.next_radps, out.blocked = low_v, min(max(0.0, low_w), high_w), 1.0
    for i in range(s.speeds):
        speed = high_v - (high_v - low_v) * i / max(s.speeds - 1, 1)
        for j in range(s.turns + 1):
            turn, cost = arcs[j, 0], path_and_goal_cost(setup, speed, arcs[j], aim_x - x, aim_y - y)
            if cost >= best:
                continue  # obstacles cannot make it any better
            if len(cover) == 0:
                cost += obstacle_cost(near2, setup, x, y, yaw, speed, turn, first2)
            else:
                cost += footprint_cost(near2, setup, cover, x, y, yaw, speed, turn, first2)
            if cost < best:
                best, out.next_mps, out.next_radps, out.blocked = cost, speed, turn, 0.0


@inner(types.void(_state, *[_f8] * 3, _setup, _f8x2, _f4x2, _u1x1, FRAME_ARRAY))
def back_off(state, x, y, yaw, setup, cover, near2, flat, frame):
    """Have a standing polygon back straight off if the known area behind it is clear, as
    TrajectoryPlannerROS does when no other velocity is clear; else the robot is blocked."""
    s, out = setup[0], state[0]
    if len(cover) == 0 or out.next_mps > 0.0:
        return
    far_m = s.behind_m + s.safe_m - s.radius_m + _BACK_MPS * s.rollout_s
    first2 = required2(near2, setup, cover, x, y, yaw)
    clear = footprint_cost(near2, setup, cover, x, y, yaw, -_BACK_MPS, 0.0, first2) < np.inf
    clear = clear and line_below(flat, frame, out.x_m, out.y_m,
                                 out.x_m - far_m * cos(out.yaw_rad),
                                 out.y_m - far_m * sin(out.yaw_rad), LETHAL)
    out.next_mps, out.next_radps = -_BACK_MPS if clear else 0.0, 0.0
    out.blocked = 0.0 if clear else 1.0


@inner(types.void(_state, _f8x2, _setup, _f8x2, _f4x2, LAYER_ARRAY, SCAN_ARRAY, _u1x1,
                  FRAME_ARRAY))
def find_velocity(state, way, setup, cover, near2, layer, scan, flat, frame):
    """Find the next velocity on ``way``."""
    s, out, seen, v = setup[0], state[0], scan[0], state[0].speed_mps
    px, py, out.togo_m = aim(way, state, setup, flat, frame)
    c, si = cos(seen.yaw_rad), sin(seen.yaw_rad)
    dx, dy = out.x_m - seen.x_m, out.y_m - seen.y_m
    x, y, yaw = c * dx + si * dy, c * dy - si * dx, out.yaw_rad - seen.yaw_rad
    dx, dy = px - out.x_m, py - out.y_m
    dx, dy, out.blocked = around(near2, setup, cover, x, y, yaw, c * dx + si * dy,
                                 c * dy - si * dx)
    if out.blocked > 0.0:
        out.next_mps, out.next_radps = max(v - s.speed_step_mps, 0.0), 0.0
        back_off(state, x, y, yaw, setup, cover, near2, flat, frame)
        return
    off = atan2(dy, dx) - yaw
    off -= 2.0 * math.pi * np.floor(off / (2.0 * math.pi) + 0.5)
    turns = abs(off) > _TURN_FIRST_RAD and v < _SLOW_MPS
    if turns and turn_is_clear(near2, s.cell_m, cover, x, y, yaw, off, _STEP_M / s.around_m,
                               required2(near2, setup, cover, x, y, yaw)):
        # The fastest turn that can still stop in time: w^2 = 2 a off.
        turn = min(math.sqrt(2.0 * _GENTLE * s.turn_acceleration_radps2 * abs(off)),
                   s.max_turn_radps)
        out.next_mps, out.next_radps = max(v - s.speed_step_mps, 0.0), math.copysign(turn, off)
        return
    # Aim beyond the end of the way: a robot brakes when it is there, not long before.
    beyond = max(s.look_ahead_m / math.sqrt(dx * dx + dy * dy + 1e-9), 1.0)
    # The arc through the aim has the radius d / (2 sin off): v = w r, or a robot would circle it.
    arc_v = _ARC_RADPS * math.sqrt(dx * dx + dy * dy) / (2.0 * abs(sin(off)) + 1e-9)
    # What comes takes its part of the gap; it is no faster than a robot.
    come_v = min(layer[0].come_mps, s.max_speed_mps)
    yield_v = (layer[0].yield_m - s.yield_m) / _YIELD_S - come_v
    top_v = max(min(arc_v, yield_v), _CREEP_MPS)
    window(near2, setup, cover, state, x, y, yaw, top_v, x + beyond * dx, y + beyond * dy)
    if turns or out.blocked > 0.0:
        back_off(state, x, y, yaw, setup, cover, near2, flat, frame)


@lean(types.UniTuple(_f8, 2)(_f8x2, *[_f8] * 3, _u1x1, FRAME_ARRAY))
def carrot(way, x, y, far_m, flat, frame):
    """The point of ``way`` that is ``far_m`` on, or a quarter, half or three quarters of it nearer:
    the farthest to which the line from (x, y) is clear."""
    for k in range(_AIMS):
        px, py, _ = ahead(way, 0, 0.0, far_m * (_AIMS - k) / _AIMS, 0.0)
        if clear_line(flat, frame, x, y, px, py):
            return px, py
    return px, py


@lean(types.boolean(*[_f8] * 4, _setup, _f8x2, _f4x2, SCAN_ARRAY))
def can_turn(x, y, yaw, by, setup, cover, near2, scan):
    """Whether the robot at this pose on the map can turn on the spot by the angle ``by``."""
    s, seen = setup[0], scan[0]
    c, si = cos(seen.yaw_rad), sin(seen.yaw_rad)
    dx, dy = x - seen.x_m, y - seen.y_m
    x, y, yaw = c * dx + si * dy, c * dy - si * dx, yaw - seen.yaw_rad
    return turn_is_clear(near2, s.cell_m, cover, x, y, yaw, by, _STEP_M / s.around_m,
                         required2(near2, setup, cover, x, y, yaw))


@lean(types.UniTuple(_f8, 4)(*[_f8] * 5, _state, _f8x2, _setup, _f8x2, _f4x2, LAYER_ARRAY,
                             SCAN_ARRAY, _u1x1, FRAME_ARRAY))
def steer(x, y, yaw, speed, turn, state, way, setup, cover, near2, layer, scan, flat, frame):
    """The next velocity on ``way`` for a robot at this pose on the map and this velocity, the
    length of the rest of the path, and 1.0 if the robot is blocked. Numbers as arguments and
    results: to write and read a record from Python takes 1 us."""
    s = state[0]
    s.x_m, s.y_m, s.yaw_rad, s.speed_mps, s.turn_radps = x, y, yaw, speed, turn
    find_velocity(state, way, setup, cover, near2, layer, scan, flat, frame)
    return s.next_mps, s.next_radps, s.togo_m, s.blocked
