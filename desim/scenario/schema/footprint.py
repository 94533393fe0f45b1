"""Footprints: the outlines of bodies that are no discs, and what is wrong with one."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations

Corner = tuple[float, float]  # x m ahead, y m to the left of the point around which a body turns
Corners = Sequence[Corner]


def radii_m(corners: Corners) -> tuple[float, float]:
    """The inscribed and the circumscribed radius: the least distance of a side, and the greatest of
    a corner, from the origin, which lies inside (costmap_2d, ``calculateMinAndMaxDistances``)."""
    return (min(_offset_m(a, b) for a, b in sides(corners)),
            max(math.hypot(x_m, y_m) for x_m, y_m in corners))


def sides(corners: Corners) -> Iterator[tuple[Corner, Corner]]:
    """The sides, from each corner to the next one and from the last to the first."""
    return zip(corners, (*corners[1:], corners[0]), strict=True)


def anticlockwise(corners: Corners) -> tuple[Corner, ...]:
    """The same corners anticlockwise, the first one first."""
    area2_m2 = sum(_cross(a, b) for a, b in sides(corners))
    return tuple(corners) if area2_m2 > 0.0 else (corners[0], *reversed(corners[1:]))


def holds(corners: Corners, x_m: float, y_m: float) -> bool:
    """Whether a point lies within the footprint or on its outline."""
    moved = [(x - x_m, y - y_m) for x, y in anticlockwise(corners)]
    return all(_cross(a, b) >= -1e-12 for a, b in sides(moved))


def complaints(corners: Corners) -> Iterator[tuple[int | None, str]]:
    """The first thing that is wrong: the number of a corner, or None for the whole, and a text."""
    count, pairs = len(corners), list(sides(corners))
    for i, (a, b) in enumerate(pairs):
        if a == b:
            yield (i + 1) % count, "is the same as the corner before"
            return
    for i, j in combinations(range(count), 2):
        if 1 < j - i < count - 1 and _meet(*pairs[i], *pairs[j]):
            yield None, (f"must not cross itself; the sides from corner {i} and from corner {j} do "
                         "(counted from 0)")
            return
    ordered = anticlockwise(corners)
    for i, b in enumerate(ordered):
        if not _bends_left(ordered[i - 1], b, ordered[(i + 1) % count]):
            yield corners.index(b), "is no corner of a convex polygon; allowed: convex ones"
            return
    if not all(_cross(a, b) > 0.0 for a, b in sides(ordered)):
        yield None, "must have (0 m, 0 m) inside, the point around which the robot turns"


def _cross(a: Corner, b: Corner) -> float:
    return a[0] * b[1] - a[1] * b[0]


def _turn(a: Corner, b: Corner, c: Corner) -> float:
    """Positive where the way from a by b to c turns left."""
    return _cross((b[0] - a[0], b[1] - a[1]), (c[0] - b[0], c[1] - b[1]))


def _bends_left(a: Corner, b: Corner, c: Corner) -> bool:
    """Whether the way from a by b to c goes on straight or to the left."""
    turn = _turn(a, b, c)
    ahead = (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1])
    return turn > 0.0 or (turn == 0.0 and ahead > 0.0)


def _meet(a: Corner, b: Corner, c: Corner, d: Corner) -> bool:
    """Whether the sides a b and c d have a point in common."""
    apart = any(max(a[k], b[k]) < min(c[k], d[k]) or max(c[k], d[k]) < min(a[k], b[k])
                for k in (0, 1))
    return not apart and (_turn(a, b, c) * _turn(a, b, d) <= 0.0
                          and _turn(c, d, a) * _turn(c, d, b) <= 0.0)


def _offset_m(a: Corner, b: Corner) -> float:
    """The distance of the origin from the side a b."""
    ex, ey = b[0] - a[0], b[1] - a[1]
    along = -(a[0] * ex + a[1] * ey) / (ex * ex + ey * ey or 1.0)
    along = min(max(along, 0.0), 1.0)
    return math.hypot(a[0] + along * ex, a[1] + along * ey)
