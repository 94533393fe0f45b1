"""Solid polygons in plan: their sides, what is solid in them, and what the radio meets."""

from __future__ import annotations

import math

import numpy as np

from desim.world.geometry import TOUCH_M, Row
from desim.world.obstacles import BLOCK_M

STRIP_M = 0.1  # the solid part of a polygon is strips of this depth, which lie inside of it
_THINNER = 4  # a thin polygon has strips of this part of its thickness
_MOST_STRIPS = 2000
_THINNEST_M = 0.001
_SQUARE = 1e-3  # the cosine of an angle that counts as a right one


def sides(points: np.ndarray) -> list[Row]:
    """The sides x1 y1 x2 y2 of a polygon ``points`` [n, 2], in order."""
    return [(*a, *b) for a, b in zip(points.tolist(), np.roll(points, -1, axis=0).tolist(),
                                     strict=True)]


def strips(points: np.ndarray) -> list[Row]:
    """Rectangles x0 y0 x1 y1 inside of a polygon ``points`` [n, 2]: what lies between its sides
    at the lower and at the upper edge of each strip (even-odd rule). They overlap by a hair, so
    that no point lies between two of them."""
    low, high = points[:, 1].min(), points[:, 1].max()
    step_m = min(STRIP_M, _thickness_m(points) / _THINNER)
    count = min(max(1, math.ceil((high - low) / step_m)), _MOST_STRIPS)
    edges = np.linspace(low, high, count + 1)
    hair = (high - low) * 1e-9
    found = []
    for y0, y1 in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        below, above = _inside(points, y0 + hair), _inside(points, y1 - hair)
        start = y0 if y0 == low else y0 - TOUCH_M
        found += [(max(a0, b0), start, min(a1, b1), y1) for a0, a1 in below for b0, b1 in above
                  if max(a0, b0) < min(a1, b1)]
    return found


def middle(points: np.ndarray) -> tuple[Row, float] | None:
    """The line along the middle of a polygon that is a wall to the radio, and its thickness in m.

    None for a polygon that is thicker than a wall. One with four right angles may lie at any
    angle, any other one is as thick as its smallest upright box."""
    if len(points) == 4 and _has_right_angles(points):
        a, b, c, d = points
        if np.hypot(*(b - a)) < np.hypot(*(c - b)):
            a, b, c, d = b, c, d, a
        thick_m = float(np.hypot(*(c - b)))
        line = (*((a + d) / 2), *((b + c) / 2))
    else:
        (x0, y0), (x1, y1) = points.min(axis=0), points.max(axis=0)
        thick_m = float(min(x1 - x0, y1 - y0))
        x, y = (x0 + x1) / 2, (y0 + y1) / 2
        line = (x0, y, x1, y) if x1 - x0 >= y1 - y0 else (x, y0, x, y1)
    if thick_m > BLOCK_M:
        return None
    x1, y1, x2, y2 = map(float, line)
    return (x1, y1, x2, y2), thick_m


def _thickness_m(points: np.ndarray) -> float:
    """About that of a polygon: its area as a share of the diagonal of its upright box."""
    (x1, y1), (x2, y2) = points.T, np.roll(points, -1, axis=0).T
    area_m2 = abs(float((x1 * y2 - x2 * y1).sum())) / 2
    return max(area_m2 / float(np.hypot(*np.ptp(points, axis=0))), _THINNEST_M)


def _has_right_angles(points: np.ndarray) -> bool:
    along = np.roll(points, -1, axis=0) - points
    along = along / np.hypot(along[:, 0], along[:, 1])[:, None]
    return bool(np.abs((along * np.roll(along, -1, axis=0)).sum(axis=1)).max() < _SQUARE)


def _inside(points: np.ndarray, y: float) -> list[tuple[float, float]]:
    """The spans of x that lie inside of a polygon at the height ``y``."""
    (x1, y1), (x2, y2) = points.T, np.roll(points, -1, axis=0).T
    crossed = (y1 <= y) != (y2 <= y)
    x = x1[crossed] + (y - y1[crossed]) / (y2[crossed] - y1[crossed]) * (x2 - x1)[crossed]
    x.sort()
    return list(zip(x[0::2].tolist(), x[1::2].tolist(), strict=True))
