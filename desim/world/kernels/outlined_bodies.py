"""Bodies in motion where some are convex polygons: as ``bodies``, with other contacts.

A polygon is pushed out of what it overlaps without being turned. Where there is no room to get out,
as when it turns between walls that are nearer than its corners, it goes back to where the tick
began, heading and all: its turn ends.

``matter`` is (walls, tops, indexed, tiles, raster, discs) of ``bodies.advance``, ``outlines`` is
(corners, first, placed) of ``outline.place``; arrays of robots are those of ``bodies`` everywhere.
"""

import numpy as np

from desim.ports.kernels import inner, kernel, types
from desim.world.kernels import contact, outline
from desim.world.kernels.bodies import (
    CLEARANCE,
    MARK,
    PUSHED,
    PUSHES,
    PUT_BACK,
    RADIUS,
    ROUNDS,
    SLOP_M,
    TOLERANCE_M,
    UNTOUCHED,
    WALL_CONTACT,
    YAW,
    X,
    Y,
    drive,
    move_all,
    near_pairs,
    put_back,
    settle,
)
from desim.world.kernels.contact import RASTER, TILES

_i8, _f8x1, _f8x2 = types.int64, types.float64[::1], types.float64[:, ::1]
_i8x1, _i8x2 = types.int64[::1], types.int64[:, ::1]
_ROWS = types.Array(types.float64, 2, "C", readonly=True)
_CONTACT = types.UniTuple(types.float64, 3)
_MATTER = types.Tuple([_ROWS, _f8x1, _i8, TILES, RASTER, _ROWS])
_OUTLINES = types.Tuple([_f8x2, _i8x1, _f8x2])
_TURN = 2  # column of velocities


@inner(_CONTACT(_f8x2, _f8x2, _i8, _i8, _OUTLINES))
def between(poses, limits, a, b, outlines):
    """The contact of robot a with robot b."""
    _, first, placed = outlines
    p, q = placed[first[a]:first[a + 1]], placed[first[b]:first[b + 1]]
    x, y, radius = poses[a, 0], poses[a, 1], limits[a, RADIUS]
    other_x, other_y, other = poses[b, 0], poses[b, 1], limits[b, RADIUS]
    if len(p) == 0 and len(q) == 0:
        return contact.deeper(x - other_x, y - other_y, radius + other, outline.NONE)
    if len(q) == 0:
        return outline.against_disc(p, other_x, other_y, other, outline.NONE)
    if len(p) == 0:
        depth, nx, ny = outline.against_disc(q, x, y, radius, outline.NONE)
        return depth, -nx, -ny
    return outline.overlap(p, q, outline.NONE)


@inner(_CONTACT(_f8x2, _f8x2, _i8, _MATTER, _OUTLINES, _f8x2))
def with_matter(poses, limits, r, matter, outlines, cell):
    """The deepest contact of a robot with fixed matter and moving obstacles."""
    _, first, placed = outlines
    walls, tops, indexed, tiles, raster, discs = matter
    x, y, radius, clearance = poses[r, 0], poses[r, 1], limits[r, RADIUS], limits[r, CLEARANCE]
    if first[r] == first[r + 1]:
        return contact.deepest(x, y, radius, clearance, walls, tops, indexed, tiles, raster, discs)
    return outline.deepest(placed[first[r]:first[r + 1]], x, y, radius, clearance, walls, tops,
                           indexed, tiles, raster, discs, cell)


@inner(types.void(_f8x2, _f8x2, _i8, types.float64, types.float64, _OUTLINES))
def push(poses, before, r, dx, dy, outlines):
    """Move a robot and mark it."""
    _, first, placed = outlines
    poses[r, 0] += dx
    poses[r, 1] += dy
    for i in range(first[r], first[r + 1]):
        placed[i, 0] += dx
        placed[i, 1] += dy
    before[r, MARK] = PUSHED


@inner(_i8(_f8x2, _f8x2, _f8x2, _i8x2, _i8, _i8x2, _i8, _i8, _i8x2, _i8, _OUTLINES))
def part_pairs(poses, before, limits, pairs, count, last, now_ns, episode_ns, episodes, found,
               outlines):
    """``bodies.part_pairs``, of any shapes."""
    acted = False
    for k in range(count):
        a, b = pairs[k, 0], pairs[k, 1]
        depth, nx, ny = between(poses, limits, a, b, outlines)
        if depth <= SLOP_M:
            continue
        acted = True
        push(poses, before, a, 0.5 * depth * nx, 0.5 * depth * ny, outlines)
        push(poses, before, b, -0.5 * depth * nx, -0.5 * depth * ny, outlines)
        if now_ns - last[a, b] > episode_ns:
            episodes[found, 0], episodes[found, 1] = a, b
            found += 1
        last[a, b] = now_ns
    return found if acted else -1 - found


@inner(_i8(_f8x2, _f8x2, _f8x2, _i8x2, _i8, _i8, _i8x2, _i8, _MATTER, _OUTLINES, _f8x2))
def part_from_matter(poses, before, limits, clocks, now_ns, episode_ns, episodes, found, matter,
                     outlines, cell):
    """Push robots out of fixed matter, and note the episodes that begin. Returns as
    ``part_pairs``."""
    acted = False
    for r in range(len(poses)):
        for _ in range(PUSHES):
            depth, nx, ny = with_matter(poses, limits, r, matter, outlines, cell)
            if depth <= SLOP_M:
                break
            acted = True
            push(poses, before, r, depth * nx, depth * ny, outlines)
            if now_ns - clocks[r, WALL_CONTACT] > episode_ns:
                episodes[found, 0], episodes[found, 1] = r, -1
                found += 1
            clocks[r, WALL_CONTACT] = now_ns
    return found if acted else -1 - found


@inner(types.void(_f8x2, _f8x2, _f8x2, _i8, _OUTLINES))
def take_back(poses, velocities, before, r, outlines):
    """``bodies.put_back``; a polygon turns back too, and turns no more."""
    corners, first, placed = outlines
    put_back(poses, before, r)
    if first[r] < first[r + 1]:
        poses[r, 2], velocities[r, _TURN] = before[r, YAW], 0.0
        outline.place(poses, r, corners, first, placed)


@inner(types.void(_f8x2, _f8x2, _f8x2, _f8x2, _i8x2, _i8, _MATTER, _OUTLINES, _f8x2))
def undo(poses, velocities, before, limits, pairs, count, matter, outlines, cell):
    """Take back the ticks of robots that no pushing got out of what they overlap."""
    acted = True
    while acted:
        acted = False
        for r in range(len(poses)):
            if before[r, MARK] == PUSHED and with_matter(
                    poses, limits, r, matter, outlines, cell)[0] > TOLERANCE_M:
                take_back(poses, velocities, before, r, outlines)
                acted = True
        for k in range(count):
            a, b = pairs[k, 0], pairs[k, 1]
            moved = before[a, MARK] != PUT_BACK or before[b, MARK] != PUT_BACK
            if moved and between(poses, limits, a, b, outlines)[0] > TOLERANCE_M:
                take_back(poses, velocities, before, a, outlines)
                take_back(poses, velocities, before, b, outlines)
                acted = True


@kernel(_i8(*[_f8x2] * 4, _i8x2, _i8x1, _i8x2, _f8x2, _i8x2, _f8x1, _ROWS, _f8x1, _i8, TILES,
            RASTER, _ROWS, _i8, types.float64, _i8, _i8x2, _f8x2, _i8x1, _f8x2))
def advance(poses, velocities, commands, limits, clocks, order, pairs, before, last, travelled,
            walls, tops, indexed, tiles, raster, discs, now_ns, dt_s, episode_ns, episodes,
            corners, first, placed):
    """``bodies.advance`` of discs and polygons."""
    matter = walls, tops, indexed, tiles, raster, discs
    outlines, cell = (corners, first, placed), np.empty((4, 2))
    for r in range(len(poses)):
        before[r, X], before[r, Y], before[r, YAW] = poses[r, 0], poses[r, 1], poses[r, 2]
        before[r, MARK] = UNTOUCHED
    drive(velocities, commands, limits, clocks, now_ns, dt_s)
    move_all(poses, velocities, dt_s)
    outline.place_all(poses, corners, first, placed)
    count = near_pairs(poses, limits, order, pairs)
    found = 0
    for _ in range(ROUNDS):
        found = part_pairs(poses, before, limits, pairs, count, last, now_ns, episode_ns, episodes,
                           found, outlines)
        acted = found >= 0
        found = found if acted else -1 - found
        found = part_from_matter(poses, before, limits, clocks, now_ns, episode_ns, episodes, found,
                                 matter, outlines, cell)
        acted = acted or found >= 0
        found = found if found >= 0 else -1 - found
        if not acted:
            break
    if acted:
        undo(poses, velocities, before, limits, pairs, count, matter, outlines, cell)
    settle(poses, velocities, before, travelled, dt_s)
    return found
