"""Moving scenery: doors on a schedule, and discs on their paths.

Neither ever touches a robot. A door that shall close waits until it is clear; a moving obstacle
waits while a robot or a closed door is in its way. Moving obstacles pass through each other.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from desim.errors import InputError
from desim.ports import materials
from desim.scenario.schema.environment import Door, MovingObstacle
from desim.units import NEVER_NS, SPEED
from desim.world.geometry import TOUCH_M, point_distance, segments
from desim.world.obstacles import crossing
from desim.world.sources import line
from desim.world.terrain import Terrain


class Doors:
    """The doors: ``lines`` [d, 4] m | ``closed`` [d] bool."""

    def __init__(self, doors: Sequence[Door], bounds: tuple[float, float, float, float]) -> None:
        self.lines = segments(line(f"environment.doors.{i}", bounds, door.start_m, door.end_m)
                              for i, door in enumerate(doors))
        self.material = np.array([materials.index(door.material, f"environment.doors.{i}.material")
                                  for i, door in enumerate(doors)], dtype=np.int64)
        self.thickness_m = np.array([door.thickness_m for door in doors], dtype=np.float64)
        self.height_m = np.array([door.height_m for door in doors], dtype=np.float64)
        self._open_ns = [door.open_ns for door in doors]
        self.closed = np.array([not self._shall_open(i, 0) for i in range(len(doors))], dtype=bool)
        self._next_ns = self._next_change_ns(0)

    def advance(self, now_ns: int, discs: np.ndarray) -> bool:
        """Follow the schedule at ``now_ns``; True if a door moved. A door does not
        close upon any of ``discs`` [k, 3] x, y, radius."""
        if now_ns < self._next_ns:
            return False
        moved = waiting = False
        for i in range(len(self.lines)):
            close = not self._shall_open(i, now_ns)
            if close == self.closed[i]:
                continue
            distance_m = point_distance(discs[:, :2], self.lines[i:i + 1])[:, 0]
            if close and (distance_m < discs[:, 2]).any():
                waiting = True
            else:
                self.closed[i], moved = close, True
        self._next_ns = now_ns if waiting else self._next_change_ns(now_ns)
        return moved

    def _shall_open(self, door: int, now_ns: int) -> bool:
        return any(start_ns <= now_ns < end_ns for start_ns, end_ns in self._open_ns[door])

    def _next_change_ns(self, now_ns: int) -> int:
        times = (time_ns for spans in self._open_ns for span in spans for time_ns in span)
        return min((time_ns for time_ns in times if time_ns > now_ns), default=NEVER_NS)


class Movers:
    """Discs that drive along way points, there and back. ``discs`` [m, 3] x, y, radius in m."""

    def __init__(self, movers: Sequence[MovingObstacle], terrain: Terrain, tick_s: float) -> None:
        self._paths = [_path(f"environment.moving_obstacles.{i}", mover, terrain, tick_s)
                       for i, mover in enumerate(movers)]
        self._speeds_mps = [mover.speed_mps for mover in movers]
        self._driven_m = [0.0] * len(movers)
        self.discs = np.array([(*mover.path_m[0], mover.radius_m) for mover in movers],
                              dtype=np.float64).reshape(-1, 3)

    def advance(self, dt_s: float, robots: np.ndarray, doors: np.ndarray) -> None:
        """Drive on for ``dt_s``, unless one of ``robots`` [n, 3] x, y, radius or of the closed
        ``doors`` [d, 4] is in the way. ``discs`` is a new array afterwards."""
        discs = self.discs.copy()
        for i, path in enumerate(self._paths):
            driven_m = self._driven_m[i] + self._speeds_mps[i] * dt_s
            x, y = _along(path, driven_m)
            here, radius = discs[i, :2], discs[i, 2]
            then_m = np.hypot(robots[:, 0] - x, robots[:, 1] - y)
            now_m = np.hypot(robots[:, 0] - here[0], robots[:, 1] - here[1])
            if ((then_m < robots[:, 2] + radius) & (then_m < now_m)).any():
                continue
            if (point_distance(np.array([[x, y]]), doors) < radius).any():
                continue
            self._driven_m[i] = driven_m
            discs[i, :2] = x, y
        self.discs = discs


def _path(what: str, mover: MovingObstacle, terrain: Terrain, tick_s: float) -> np.ndarray:
    """[k, 3]: way points x, y and the length of the path up to them in m. Raises ``InputError`` for
    a speed at which a tick would step over an obstacle, and for a path that is not free."""
    step_m, highest_m = mover.speed_mps * tick_s, mover.radius_m / 2.0
    if step_m > highest_m + TOUCH_M:
        raise InputError(
            f"{what}.speed: at {SPEED.format(mover.speed_mps)} it covers {step_m:g} m in a tick "
            "and could pass through robots and closed doors; allowed: half its radius "
            f"({highest_m:g} m) a tick, at most {SPEED.format(highest_m / tick_s)}")

    points = np.array(mover.path_m, dtype=np.float64)
    steps = np.hypot(*np.diff(points, axis=0).T)
    if not (steps > 0.0).all():
        raise InputError(f"{what}.path: the same way point twice in a row")
    legs = np.concatenate([points[:-1], points[1:]], axis=1)
    # Where two lines do not cross, an end of one of them is nearest to the other.
    clear_m = min(terrain.clearance(points, mover.radius_m).min(),
                 point_distance(terrain.walls.reshape(-1, 2), legs).min())
    if clear_m < mover.radius_m - TOUCH_M or len(crossing(terrain.walls, legs)):
        raise InputError(f"{what}.path: crosses a wall or leaves the terrain, or comes closer to "
                         f"a wall than its radius of {mover.radius_m:g} m")
    return np.column_stack([points, np.concatenate([[0.0], np.cumsum(steps)])])


def _along(path: np.ndarray, driven_m: float) -> tuple[float, float]:
    """The point of a path [k, 3] after ``driven_m``, there and back again."""
    length = path[-1, 2]
    at = driven_m % (2.0 * length)
    at = min(at, 2.0 * length - at)
    return float(np.interp(at, path[:, 2], path[:, 0])), float(np.interp(at, path[:, 2],
                                                                        path[:, 1]))
