"""Places in the plane, and curves of drawings as chains of short straight lines."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from desim.imports.terrains.found import Point

_STEP_RAD = math.pi / 18  # a chord leaves its arc by 0.4 % of the radius
_PARTS = 12  # of a Bezier curve


class Affine(NamedTuple):
    """The map x' = a x + c y + e, y' = b x + d y + f, in SVG's order of letters."""

    a: float = 1.0
    b: float = 0.0
    c: float = 0.0
    d: float = 1.0
    e: float = 0.0
    f: float = 0.0

    def after(self, first: Affine) -> Affine:
        """The map that takes ``first`` and then this one."""
        return Affine(self.a * first.a + self.c * first.b, self.b * first.a + self.d * first.b,
                      self.a * first.c + self.c * first.d, self.b * first.c + self.d * first.d,
                      *self.at((first.e, first.f)))

    def at(self, point: Point) -> Point:
        """The image of a point."""
        x, y = point
        return self.a * x + self.c * y + self.e, self.b * x + self.d * y + self.f

    def of(self, points: Iterable[Point]) -> list[Point]:
        """The images of several points."""
        return [self.at(point) for point in points]

    @property
    def scale(self) -> float:
        """The factor of lengths, in the mean of all directions."""
        return math.sqrt(abs(self.a * self.d - self.b * self.c))


def turned(angle_rad: float) -> Affine:
    """A turn around the origin, anticlockwise where y points up."""
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    return Affine(cos, sin, -sin, cos)


def arc(centre: Point, rx: float, ry: float, start_rad: float, sweep_rad: float,
        turn_rad: float = 0.0) -> list[Point]:
    """Points on an ellipse with its first half axis ``rx`` turned by ``turn_rad``, both ends
    among them. Angles are those of the ellipse's parameter."""
    parts = max(2, math.ceil(abs(sweep_rad) / _STEP_RAD - 1e-9))
    place = turned(turn_rad)._replace(e=centre[0], f=centre[1])
    return place.of((rx * math.cos(angle), ry * math.sin(angle)) for angle in (
        start_rad + sweep_rad * part / parts for part in range(parts + 1)))


def circle(centre: Point, rx: float, ry: float) -> list[Point]:
    """A whole ellipse, without its first point again."""
    return arc(centre, rx, ry, 0.0, 2 * math.pi)[:-1]


def bezier(poles: Sequence[Point]) -> list[Point]:
    """Points on a Bezier curve of any degree behind its first pole (de Casteljau)."""
    found = []
    for part in range(1, _PARTS + 1):
        t, rest = part / _PARTS, list(poles)
        while len(rest) > 1:
            rest = [(x1 + t * (x2 - x1), y1 + t * (y2 - y1))
                    for (x1, y1), (x2, y2) in zip(rest, rest[1:], strict=False)]
        found.append(rest[0])
    return found
