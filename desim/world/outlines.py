"""Outlines of bodies that are polygons: their corners on the ground, and what they overlap."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from desim.scenario.schema.fleet import BodyType
from desim.world.geometry import point_distance
from desim.world.kernels import outline as kernels


class Outlines:
    """The outlines of a fleet's bodies.

    ``corners`` [k, 2] m of all of them, anticlockwise, in their own frames; those of robot r are
    from ``first[r]`` to ``first[r + 1]``. A disc has none.
    """

    def __init__(self, bodies: Sequence[BodyType]) -> None:
        corners = [body.corners_m for body in bodies]
        self.corners = np.array([corner for own in corners for corner in own]).reshape(-1, 2)
        self.first = np.cumsum([0, *map(len, corners)])
        self.is_disc = np.diff(self.first) == 0
        self._next = np.arange(1, len(self.corners) + 1)
        self._next[self.first[1:][~self.is_disc] - 1] = self.first[:-1][~self.is_disc]

    def placed(self, poses: np.ndarray) -> np.ndarray:
        """[k, 2] m the corners where they are with robots at ``poses`` [n, 3]."""
        placed = np.empty_like(self.corners)
        kernels.place_all(poses, self.corners, self.first, placed)
        return placed

    def sides(self, poses: np.ndarray) -> np.ndarray:
        """[k, 4] m the sides, from each corner to the next one."""
        placed = self.placed(poses)
        return np.hstack([placed, placed[self._next]])


def gaps_m(polygon: np.ndarray, others: np.ndarray) -> np.ndarray:
    """[n] m by which convex ``others`` [n, m, 2] (lines too, m = 2) lie beside ``polygon`` [k, 2],
    along the normal of a side where that is most; negative where they overlap. All corners are
    anticlockwise."""
    between = _beyond(polygon[None], others)
    return np.maximum(between, _beyond(others, polygon[None]))


def _beyond(polygons: np.ndarray, others: np.ndarray) -> np.ndarray:
    """[n] the same along normals of sides of ``polygons`` alone."""
    sides = np.roll(polygons, -1, axis=1) - polygons
    normals = np.stack([sides[..., 1], -sides[..., 0]], axis=2)
    normals /= np.hypot(sides[..., 0], sides[..., 1])[..., None]
    ends = (normals * polygons).sum(axis=2)
    return ((normals @ others.transpose(0, 2, 1)).min(axis=2) - ends).max(axis=1)


def disc_gap_m(polygon: np.ndarray, x_m: float, y_m: float, radius_m: float) -> float:
    """The distance in m of a disc from ``polygon`` [k, 2]; negative where they overlap."""
    centre = np.array([[x_m, y_m]])
    sides = np.hstack([polygon, np.roll(polygon, -1, axis=0)])
    inside = _beyond(polygon[None], centre[None])[0] <= 0.0
    return float(-radius_m if inside else point_distance(centre, sides).min() - radius_m)
