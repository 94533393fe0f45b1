"""Outlines of bodies that are polygons: their corners and sides on the ground."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from desim.scenario.schema.fleet import BodyType
from desim.world.kernels import outline as kernels
from desim.world.kernels.outline import Polygons


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

    def at(self, poses: np.ndarray) -> Polygons:
        """The polygons where they are with robots at ``poses`` [n, 3]."""
        polygons = Polygons(self.corners, self.first, np.empty_like(self.corners))
        kernels.place_all(poses, polygons)
        return polygons

    def sides(self, poses: np.ndarray) -> np.ndarray:
        """[k, 4] m the sides, from each corner to the next one."""
        placed = self.at(poses).placed
        return np.hstack([placed, placed[self._next]])
