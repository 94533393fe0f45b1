"""The depth of bodies in walls and in each other, at every tick of a run.

For acceptance.py and tests. It uses nothing of the simulator's own collisions, only distances of
points from segments.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

CHUNK = 600  # ticks checked together: 10 s, in which a robot stays near a few walls
NEAR_M = 1.0


class Depth(NamedTuple):
    """The deepest that a body ever was in a wall (negative: it never touched one), and two bodies
    in each other, in m."""

    wall_m: float
    body_m: float


class Ticks:
    """Records the poses after every world tick of ``simulation``, a ``Simulation`` that has not run
    yet. Doors and moving obstacles are not checked."""

    def __init__(self, simulation: Any) -> None:
        self._world = world = simulation.world
        self._poses = [world.snapshot().poses]
        advance = world.advance

        def advance_and_note(to_ns: int) -> None:
            advance(to_ns)
            self.note(world.snapshot().poses)

        world.advance = advance_and_note

    def __len__(self) -> int:
        return len(self._poses)

    def note(self, poses: np.ndarray) -> None:
        """One more tick's poses, [robots, 3]."""
        self._poses.append(poses.copy())

    def deepest(self) -> Depth:
        """Over all ticks, robots and walls."""
        places = np.array(self._poses)[:, :, :2]
        terrain, count = self._world.terrain, places.shape[1]
        radii_m = np.array([self._world.body(i).radius_m for i in range(count)])
        wall = body = -np.inf
        for begin in range(0, len(places), CHUNK):
            chunk = places[begin:begin + CHUNK]
            for robot in range(count):
                room_m = clearance_m(chunk[:, robot], terrain.walls, terrain.solids, terrain.bounds)
                wall = max(wall, radii_m[robot] - room_m)
            if count > 1:
                body = max(body, _overlap(chunk, radii_m))
        return Depth(float(wall), float(body))


def clearance_m(points: np.ndarray, walls: np.ndarray, solids: np.ndarray,
         bounds: tuple[float, float, float, float]) -> float:
    """m from the nearest of ``points`` [k, 2] to a wall [n, 4] (at most ``NEAR_M``); minus
    infinity if one lies in a solid x0 y0 x1 y1 [m, 4] or outside ``bounds``."""
    low, high = points.min(axis=0), points.max(axis=0)
    x0, y0, x1, y1 = bounds
    if low[0] < x0 or low[1] < y0 or high[0] > x1 or high[1] > y1:
        return -np.inf
    for sx0, sy0, sx1, sy1 in solids[_about(solids, low, high, 0.0)].tolist():
        inside = ((points[:, 0] > sx0) & (points[:, 0] < sx1)
                  & (points[:, 1] > sy0) & (points[:, 1] < sy1))
        if inside.any():
            return -np.inf
    nearest_m = NEAR_M
    for wall in walls[_about(walls, low, high, NEAR_M)]:
        start, along = wall[:2], wall[2:] - wall[:2]
        share = ((points - start) @ along / (along @ along)).clip(0.0, 1.0)
        away = points - start - share[:, None] * along
        nearest_m = min(nearest_m, float(np.sqrt((away ** 2).sum(axis=1).min())))
    return nearest_m


def _about(boxes: np.ndarray, low: np.ndarray, high: np.ndarray, margin_m: float) -> np.ndarray:
    """A mask of the ``boxes`` [n, 4], opposite corners, near the box from ``low`` to ``high``."""
    x, y = boxes[:, 0::2], boxes[:, 1::2]
    return ((x.max(axis=1) >= low[0] - margin_m) & (x.min(axis=1) <= high[0] + margin_m)
            & (y.max(axis=1) >= low[1] - margin_m) & (y.min(axis=1) <= high[1] + margin_m))


def _overlap(places: np.ndarray, radii_m: np.ndarray) -> float:
    """The deepest that two of the bodies at ``places`` [ticks, robots, 2] are in each other."""
    first, second = np.triu_indices(places.shape[1], 1)
    apart_m = np.sqrt(((places[:, first] - places[:, second]) ** 2).sum(axis=2)).min(axis=0)
    return float((radii_m[first] + radii_m[second] - apart_m).max())
