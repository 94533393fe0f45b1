"""Bodies of another simulator, whose answers are checked."""

from __future__ import annotations

import numpy as np

from desim.errors import ModelError, class_of
from desim.ports import Arena, Bodies


class ForeignBodies:
    """``bodies`` of a plug-in, started in ``arena``. Each call raises ``ModelError`` for an answer
    that is not what ``ports.Bodies`` says."""

    def __init__(self, bodies: Bodies, arena: Arena) -> None:
        self._bodies, self._count = bodies, len(arena.robots)
        bodies.start(arena)
        self._take()

    def command(self, robot: int, velocity: tuple[float, float, float], now_ns: int) -> None:
        self._bodies.command(robot, velocity, now_ns)

    def surround(self, walls: np.ndarray, tops_m: np.ndarray, discs: np.ndarray) -> None:
        self._bodies.surround(walls, tops_m, discs)

    def advance(self, now_ns: int, dt_s: float) -> list[tuple[int, int]]:
        began = self._bodies.advance(now_ns, dt_s)
        self._take()
        if not isinstance(began, list) or not all(map(self._is_contact, began)):
            raise ModelError(f"{class_of(self._bodies)}.advance returned {began!r}; wanted: a list "
                             "of contacts (robot, other robot or -1)")
        return began

    def ahead(self, after_ns: int) -> np.ndarray:
        return self._checked("ahead()", self._bodies.ahead(after_ns), (self._count, 3))

    def _is_contact(self, pair: object) -> bool:
        match pair:
            case (int(robot), int(other)):
                return robot != other and 0 <= robot < self._count and -1 <= other < self._count
        return False

    def _take(self) -> None:
        """Read the state after a tick."""
        count, bodies = self._count, self._bodies
        self.poses = self._checked("poses", bodies.poses, (count, 3))
        self.velocities = self._checked("velocities", bodies.velocities, (count, 3))
        self.travelled_m = self._checked("travelled_m", bodies.travelled_m, (count,))

    def _checked(self, name: str, values: object, shape: tuple[int, ...]) -> np.ndarray:
        try:
            array = np.asarray(values, float)
        except (TypeError, ValueError):
            raise ModelError(f"{class_of(self._bodies)}: {name} must be numbers, got {values!r}"
                             ) from None
        if array.shape != shape or not np.isfinite(array).all():
            got = (f"shape {list(array.shape)}" if array.shape != shape
                   else f"{array[~np.isfinite(array)][0]}")
            raise ModelError(f"{class_of(self._bodies)}: {name} must be finite numbers of shape "
                             f"{list(shape)}, got {got}")
        return array
