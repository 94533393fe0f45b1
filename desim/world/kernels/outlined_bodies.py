"""Bodies in motion where some are convex polygons: as ``bodies``, with other contacts.

A polygon is pushed out of what it overlaps without being turned. Where there is no room to get out,
as when it turns between walls that are nearer than its corners, it goes back to where the tick
began, heading and all: its turn ends.
"""

import numpy as np

from desim.ports.kernels import inner, kernel, types
from desim.world.kernels import contact, outline
from desim.world.kernels.bodies import (
    BODIES,
    CLEARANCE,
    FOUND,
    MARK,
    PUSHED,
    PUSHES,
    PUT_BACK,
    RADIUS,
    ROUNDS,
    SLOP_M,
    TOLERANCE_M,
    YAW,
    drive_all,
    near_pairs,
    note_barrier,
    note_pair,
    put_back,
    settle,
)
from desim.world.kernels.contact import BARRIERS
from desim.world.kernels.outline import POLYGONS

_i8, _f8, _f8x2 = types.int64, types.float64, types.float64[:, ::1]
_CONTACT = types.UniTuple(_f8, 3)
_TURN = 2  # column of velocities


@inner(_CONTACT(BODIES, POLYGONS, _i8, _i8))
def between(bodies, polygons, a, b):
    """The contact of robot a with robot b."""
    first, placed, poses = polygons.first, polygons.placed, bodies.poses
    p, q = placed[first[a]:first[a + 1]], placed[first[b]:first[b + 1]]
    x, y, radius = poses[a, 0], poses[a, 1], bodies.limits[a, RADIUS]
    other_x, other_y, other = poses[b, 0], poses[b, 1], bodies.limits[b, RADIUS]
    if len(p) == 0 and len(q) == 0:
        return contact.deeper(x - other_x, y - other_y, radius + other, outline.NONE)
    if len(q) == 0:
        return outline.against_disc(p, other_x, other_y, other, outline.NONE)
    if len(p) == 0:
        depth, nx, ny = outline.against_disc(q, x, y, radius, outline.NONE)
        return depth, -nx, -ny
    return outline.overlap(p, q, outline.NONE)


@inner(_CONTACT(BODIES, POLYGONS, BARRIERS, _i8, _f8x2))
def with_barriers(bodies, polygons, barriers, r, cell):
    """The deepest contact of a robot with barriers. cell [4, 2]: to work in"""
    first, placed, poses, limits = polygons.first, polygons.placed, bodies.poses, bodies.limits
    x, y, radius, clearance = poses[r, 0], poses[r, 1], limits[r, RADIUS], limits[r, CLEARANCE]
    if first[r] == first[r + 1]:
        return contact.deepest(x, y, radius, clearance, barriers)
    return outline.deepest(placed[first[r]:first[r + 1]], x, y, radius, clearance, barriers, cell)


@inner(types.void(BODIES, POLYGONS, _i8, _f8, _f8))
def push(bodies, polygons, r, dx, dy):
    """Move a robot and mark it."""
    first, placed = polygons.first, polygons.placed
    bodies.poses[r, 0] += dx
    bodies.poses[r, 1] += dy
    for i in range(first[r], first[r + 1]):
        placed[i, 0] += dx
        placed[i, 1] += dy
    bodies.before[r, MARK] = PUSHED


@inner(FOUND(BODIES, POLYGONS, _i8, _i8, _i8))
def part_pairs(bodies, polygons, count, now_ns, found):
    """``bodies.part_pairs``, of any shapes."""
    acted = False
    for k in range(count):
        a, b = bodies.pairs[k, 0], bodies.pairs[k, 1]
        depth, nx, ny = between(bodies, polygons, a, b)
        if depth <= SLOP_M:
            continue
        acted = True
        push(bodies, polygons, a, 0.5 * depth * nx, 0.5 * depth * ny)
        push(bodies, polygons, b, -0.5 * depth * nx, -0.5 * depth * ny)
        found = note_pair(bodies, a, b, now_ns, found)
    return found, acted


@inner(FOUND(BODIES, POLYGONS, BARRIERS, _i8, _i8, _f8x2))
def part_from_barriers(bodies, polygons, barriers, now_ns, found, cell):
    """``bodies.part_from_barriers``, of any shapes."""
    acted = False
    for r in range(len(bodies.poses)):
        for _ in range(PUSHES):
            depth, nx, ny = with_barriers(bodies, polygons, barriers, r, cell)
            if depth <= SLOP_M:
                break
            acted = True
            push(bodies, polygons, r, depth * nx, depth * ny)
            found = note_barrier(bodies, r, now_ns, found)
    return found, acted


@inner(types.void(BODIES, POLYGONS, _i8))
def take_back(bodies, polygons, r):
    """``bodies.put_back``; a polygon turns back too, and turns no more."""
    put_back(bodies, r)
    if polygons.first[r] < polygons.first[r + 1]:
        bodies.poses[r, 2], bodies.velocities[r, _TURN] = bodies.before[r, YAW], 0.0
        outline.place(bodies.poses, r, polygons)


@inner(types.void(BODIES, POLYGONS, BARRIERS, _i8, _f8x2))
def undo(bodies, polygons, barriers, count, cell):
    """``bodies.undo``, of any shapes."""
    before = bodies.before
    acted = True
    while acted:
        acted = False
        for r in range(len(before)):
            if before[r, MARK] == PUSHED and with_barriers(
                    bodies, polygons, barriers, r, cell)[0] > TOLERANCE_M:
                take_back(bodies, polygons, r)
                acted = True
        for k in range(count):
            a, b = bodies.pairs[k, 0], bodies.pairs[k, 1]
            moved = before[a, MARK] != PUT_BACK or before[b, MARK] != PUT_BACK
            if moved and between(bodies, polygons, a, b)[0] > TOLERANCE_M:
                take_back(bodies, polygons, a)
                take_back(bodies, polygons, b)
                acted = True


@kernel(_i8(BODIES, BARRIERS, _i8, _f8, POLYGONS))
def advance(bodies, barriers, now_ns, dt_s, polygons):
    """``bodies.advance`` of discs and polygons."""
    cell = np.empty((4, 2))
    drive_all(bodies, now_ns, dt_s)
    outline.place_all(bodies.poses, polygons)
    count, found, acted = near_pairs(bodies), 0, True
    for _ in range(ROUNDS):
        found, apart = part_pairs(bodies, polygons, count, now_ns, found)
        found, acted = part_from_barriers(bodies, polygons, barriers, now_ns, found, cell)
        acted = acted or apart
        if not acted:
            break
    if acted:
        undo(bodies, polygons, barriers, count, cell)
    settle(bodies, dt_s)
    return found
