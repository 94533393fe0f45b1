"""Loops that turn a scan into points with normals."""

from typing import NamedTuple

import numpy as np

from desim.ports.kernels import cos, inner, lean, sin, types

X, Y, NX, NY = 0, 1, 2, 3  # columns of points

# All of these are ours. docs/slam.md has what another value of one makes of a real log's error.
NEIGHBOURS = 6  # beams on each side, at most, in which a normal is fitted
LEAST = 3  # and at least so many returns
# A normal is trusted if the spread across is less than this share of that along.
FLAT = 0.15
BREAK_M = 0.3  # farther neighbours are on another surface, but for distant beams
# There, neighbours up to so many spacings of beams away are on the same surface, and farther ones
# where distances grow by this factor at most: beams graze it.
SPACINGS = 2.5
EVEN = 2.0
GRAZING = 2.5  # beams that are less than so many increments off a surface met its edge, perhaps

# Not in that trial: a log has no teammates.
STEP_M = 0.25  # between the ranges of beams next to each other: one surface ends there
GONE_M = -1.0  # the range of a beam that met something in front


class Beams(NamedTuple):
    """The geometry of a laser: its first angle and increment in rad, the shortest and the longest
    range that are used in m, and the pose of the laser on the robot (m, m, rad)."""

    angle_min_rad: float
    increment_rad: float
    shortest_m: float
    longest_m: float
    mount_x_m: float
    mount_y_m: float
    mount_yaw_rad: float


BEAMS = types.NamedTuple([types.float64] * 7, Beams)


@inner("f8(f8[:,::1], i8, i8)")
def distance(points, k, j):
    """The distance between two points."""
    dx, dy = points[j, X] - points[k, X], points[j, Y] - points[k, Y]
    return np.sqrt(dx * dx + dy * dy)


@inner(types.int64(types.float64[::1], BEAMS, types.float64[:, ::1], types.float64[::1]))
def returns_of(ranges, beams, points, taken):
    """Write the places of a scan's returns to ``points``, and the range of each to ``taken``, as
    ``points_of`` has them. Returns their number."""
    count = 0
    for b in range(len(ranges)):
        length = ranges[b]
        if beams.shortest_m <= length < beams.longest_m:
            angle = beams.mount_yaw_rad + beams.angle_min_rad + b * beams.increment_rad
            points[count, X] = beams.mount_x_m + length * cos(angle)
            points[count, Y] = beams.mount_y_m + length * sin(angle)
            taken[count] = length
            count += 1
    return count


@inner(types.void(types.float64[:, ::1], types.int64, types.float64[::1], BEAMS))
def add_normals(points, count, taken, beams):
    """Write the normals of the first ``count`` points: each that of the line through the
    neighbouring returns (least squares across it), as far as they follow each other on one surface.
    """
    for k in range(count):
        reach = max(BREAK_M, SPACINGS * taken[k] * abs(beams.increment_rad))
        before = distance(points, k, k - 1) if k > 0 else np.inf
        after = distance(points, k, k + 1) if k + 1 < count else np.inf
        if max(before, after) <= EVEN * min(before, after):
            reach = max(reach, before, after)
        n, sx, sy, sxx, sxy, syy = 1, 0.0, 0.0, 0.0, 0.0, 0.0
        for side in (-1, 1):
            most = reach
            for away in range(1, NEIGHBOURS + 1):
                j = k + side * away
                if not 0 <= j < count:
                    break
                step = distance(points, j, j - side)
                if step > most:
                    break
                most = max(reach, EVEN * step)
                dx, dy = points[j, X] - points[k, X], points[j, Y] - points[k, Y]
                if dx * dx + dy * dy > 4.0 * reach * reach:
                    break
                n += 1
                sx += dx
                sy += dy
                sxx += dx * dx
                sxy += dx * dy
                syy += dy * dy
        points[k, NX] = points[k, NY] = 0.0
        if n < LEAST:
            continue
        a, b, c = sxx - sx * sx / n, sxy - sx * sy / n, syy - sy * sy / n
        root = np.sqrt(0.25 * (a - c) * (a - c) + b * b)
        along, across = 0.5 * (a + c) + root, 0.5 * (a + c) - root
        if along <= 0.0 or across > FLAT * FLAT * along:
            continue
        nx, ny = (b, across - a) if abs(across - a) > abs(across - c) else (across - c, b)
        size = np.sqrt(nx * nx + ny * ny)
        if size <= 0.0:
            continue
        seen_x, seen_y = points[k, X] - beams.mount_x_m, points[k, Y] - beams.mount_y_m
        if abs(nx * seen_x + ny * seen_y) < GRAZING * abs(beams.increment_rad) * size * taken[k]:
            continue
        if nx * (beams.mount_x_m - points[k, X]) + ny * (beams.mount_y_m - points[k, Y]) < 0.0:
            size = -size
        points[k, NX], points[k, NY] = nx / size, ny / size


@lean(types.int64(types.float64[::1], BEAMS, types.float64[:, ::1], types.float64[::1]))
def points_of(ranges, beams, points, taken):
    """Write the returns of a scan as ``points`` [beams, 4] in the robot's frame: x, y in m, and the
    unit normal of the surface towards the laser, zeros where it is not known. ``taken`` [beams]:
    the range of each. Returns their number."""
    count = returns_of(ranges, beams, points, taken)
    add_normals(points, count, taken, beams)
    return count


@lean(types.void(types.float64[::1], BEAMS, types.float64, types.float64[::1]))
def without_bodies(ranges, beams, widest_m, kept):
    """Copy ranges to ``kept``, with infinity where something stands in front that is at most
    ``widest_m`` wide: it may be a teammate's body.

    Such a thing is a run of beams without a step of ``STEP_M`` in range, from which the range steps
    up on both sides. One that is partly hidden by another is found once the other is removed.
    """
    for b in range(len(kept)):
        kept[b] = ranges[b] if beams.shortest_m <= ranges[b] < beams.longest_m else np.inf
    found = True
    while found:
        found = False
        first, last, before = 0, -1, np.inf  # the run so far, and the range of its last beam
        came_down = True
        for b in range(len(kept) + 1):
            if b < len(kept) and kept[b] == GONE_M:
                continue
            length = kept[b] if b < len(kept) else np.inf
            if abs(length - before) <= STEP_M:
                last, before = b, length
                continue
            if came_down and before < length:
                turn = (last - first) * beams.increment_rad
                ahead = kept[last] * cos(turn) - kept[first]
                aside = kept[last] * sin(turn)
                if ahead * ahead + aside * aside <= widest_m * widest_m:
                    for k in range(first, last + 1):
                        kept[k] = GONE_M
                    found = True
            came_down = length < before or last < 0
            first, last, before = b, b, length
    for b in range(len(kept)):
        if kept[b] == GONE_M:
            kept[b] = np.inf


@lean(types.int64(types.float64[:, ::1], types.int64, BEAMS, types.float64, types.float64[:, ::1]))
def thinned(points, count, beams, spacing_m, kept):
    """Copy points to ``kept`` so that those on a surface lie ``spacing_m`` or more apart, in the
    mean. Returns their number.

    Returns lie densest nearby, and would outweigh distant ones, which fix the heading. Where beams
    meet a surface closer to each other than ``spacing_m``, each return counts as the share of the
    spacing that it covers, and one is kept whenever the shares add up to one. If instead returns
    were kept that are far enough from the last one, their noise would point away from it, and the
    heading of a robot in a corridor would drift.
    """
    n, worth = 0, 1.0
    for k in range(count):
        x, y = points[k, X] - beams.mount_x_m, points[k, Y] - beams.mount_y_m
        squared = x * x + y * y
        facing = abs(x * points[k, NX] + y * points[k, NY])  # range * cosine of the incidence
        if facing == 0.0:
            facing = np.sqrt(squared)
        worth += min(squared * abs(beams.increment_rad) / (facing * spacing_m), 1.0)
        if worth < 1.0:
            continue
        worth -= 1.0
        for column in range(4):  # a copy of rows is numba's own: its code would not be kept
            kept[n, column] = points[k, column]
        n += 1
    return n
