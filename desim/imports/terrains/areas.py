"""Filled areas of drawings, with holes and with paler areas painted over them, in trapezoids."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from desim.imports.terrains.found import Point

_HAIR = 1e-9


class Area(NamedTuple):
    """The inside of closed ``rings``, by the even-odd rule or by that of windings."""

    rings: tuple[tuple[Point, ...], ...]
    even_odd: bool = False

    @property
    def box(self) -> tuple[float, float, float, float]:
        """x0 y0 x1 y1"""
        xs, ys = zip(*(point for ring in self.rings for point in ring), strict=True)
        return min(xs), min(ys), max(xs), max(ys)

    def meets(self, other: Area) -> bool:
        """Whether their boxes overlap."""
        a, b = self.box, other.box
        return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]

    def holds(self, point: Point) -> bool:
        """Whether a point lies inside."""
        winding = 0
        for x1, y1, x2, y2, number in self.edges(1):
            if y1 <= point[1] < y2 and x1 + (point[1] - y1) * (x2 - x1) / (y2 - y1) < point[0]:
                winding += number
        return bool(winding % 2 if self.even_odd else winding)

    def edges(self, number: int) -> list[tuple[float, float, float, float, int]]:
        """Those that are not level: x and y of the lower end and of the upper one, and the number
        of this area with the sign of the edge's direction."""
        return [(x1, y1, x2, y2, number) if y1 < y2 else (x2, y2, x1, y1, -number)
                for ring in self.rings
                for (x1, y1), (x2, y2) in zip(ring, (*ring[1:], ring[0]), strict=True)
                if abs(y2 - y1) > _HAIR]


def visible(start: Point, end: Point, width: float, over: Sequence[Area],
            ) -> list[tuple[Point, Point]]:
    """The parts of a line of a width that no one of the areas ``over`` it covers to both sides."""
    (x1, y1), (dx, dy) = start, (end[0] - start[0], end[1] - start[1])
    length = math.hypot(dx, dy)
    if not over or length < _HAIR:
        return [(start, end)]
    cuts = {0.0, 1.0}
    for ring in (ring for area in over for ring in area.rings):
        for (x3, y3), (x4, y4) in zip(ring, (*ring[1:], ring[0]), strict=True):
            across = dx * (y4 - y3) - dy * (x4 - x3)
            if abs(across) > _HAIR * _HAIR:
                along = ((x3 - x1) * (y4 - y3) - (y3 - y1) * (x4 - x3)) / across
                other = ((x3 - x1) * dy - (y3 - y1) * dx) / across
                if 0.0 < along < 1.0 and 0.0 <= other <= 1.0:
                    cuts.add(along)
    aside = -dy / length * width / 2, dx / length * width / 2
    parts: list[tuple[Point, Point]] = []
    for low, high in pairwise(sorted(cuts)):
        x, y = x1 + dx * (low + high) / 2, y1 + dy * (low + high) / 2
        if any(area.holds((x + aside[0], y + aside[1])) and area.holds((x - aside[0], y - aside[1]))
               for area in over):
            continue
        first, last = ((x1 + dx * share, y1 + dy * share) for share in (low, high))
        if parts and parts[-1][1] == first:
            first = parts.pop()[0]
        parts.append((first, last))
    return parts


def trapezoids(area: Area, over: Sequence[Area]) -> Iterator[list[Point]]:
    """The rest of ``area`` under the areas ``over`` it, cut at the heights of all corners.
    Where edges cross between two such heights a trapezoid is as wide as in its middle."""
    areas = [area, *over]
    edges = np.array([edge for number, one in enumerate(areas, 1) for edge in one.edges(number)])
    if not len(edges):
        return
    y0, y1 = area.box[1], area.box[3]
    heights = np.unique(np.round(edges[:, [1, 3]], 6))
    heights = heights[(heights > y0 - _HAIR) & (heights < y1 + 1e-6)]
    for low, high in zip(heights.tolist(), heights[1:].tolist(), strict=False):
        middle = (low + high) / 2
        here = edges[(edges[:, 1] < middle) & (edges[:, 3] > middle)]
        slope = (here[:, 2] - here[:, 0]) / (here[:, 3] - here[:, 1])
        at = [here[:, 0] + slope * (y - here[:, 1]) for y in (middle, low, high)]
        windings = [0] * len(areas)
        start: int | None = None
        for edge in np.argsort(at[0], kind="stable").tolist():
            number = int(here[edge, 4])
            windings[abs(number) - 1] += 1 if number > 0 else -1
            inside = [bool(winding % 2 if one.even_odd else winding)
                      for winding, one in zip(windings, areas, strict=True)]
            is_left = inside[0] and not any(inside[1:])
            if start is None and is_left:
                start = edge
            elif start is not None and not is_left:
                if at[0][edge] - at[0][start] > _HAIR:
                    yield _between(low, high, [(at[i][start], at[i][edge]) for i in range(3)])
                start = None


def _between(low: float, high: float, spans: list[tuple[float, float]]) -> list[Point]:
    (m0, m1), *ends = ((float(left), float(right)) for left, right in spans)
    (l0, l1), (h0, h1) = ((left, right) if left <= right else (m0, m1) for left, right in ends)
    return [(l0, low), (l1, low), (h1, high), (h0, high)]
