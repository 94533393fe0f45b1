"""The squares of the plane that a team has looked at with a sensor of short range."""

from __future__ import annotations

import math

import numpy as np

from desim import ports

_SIDE, _NEAR = 0.7, 0.3  # of the sensor's range: from so near a whole square of this side is seen

Square = tuple[int, int]  # column, row


class LookedAt:
    """Squares of 0.7 times ``range_m``. One is looked at by a robot that comes within 0.3 times
    ``range_m`` of its centre: its corners are then 0.8 times the range away at most."""

    def __init__(self, range_m: float) -> None:
        self._side_m, self._near_m = _SIDE * range_m, _NEAR * range_m
        self.squares: set[Square] = set()

    def visit(self, place: tuple[float, float]) -> None:
        """A robot is at ``place``."""
        square = self._square(place)
        if math.dist(place, self._centre(square)) <= self._near_m:
            self.squares.add(square)

    def give_up(self, place: tuple[float, float]) -> None:
        """The centre of a square cannot be reached."""
        self.squares.add(self._square(place))

    def nearest_left(self, robot: ports.StrategyContext) -> ports.Place | None:
        """The centre with the shortest path of the free squares that are left; None without one."""
        grid = robot.grid
        first, last = (self._square((grid.x_m + cells * grid.width * grid.resolution_m,
                                     grid.y_m + cells * grid.height * grid.resolution_m))
                       for cells in (0, 1))
        free = robot.occupancy() == 0
        left = [centre for column in range(first[0], last[0] + 1)
                for row in range(first[1], last[1] + 1) if (column, row) not in self.squares
                and _is_free(free, grid, centre := self._centre((column, row)))]
        if not left:
            return None
        lengths_m = robot.path_lengths_m(left)
        nearest = int(lengths_m.argmin())
        return left[nearest] if lengths_m[nearest] < math.inf else None

    def _square(self, place: tuple[float, float]) -> Square:
        return math.floor(place[0] / self._side_m), math.floor(place[1] / self._side_m)

    def _centre(self, square: Square) -> ports.Place:
        return ports.Place((square[0] + 0.5) * self._side_m, (square[1] + 0.5) * self._side_m)


def _is_free(free: np.ndarray, grid: ports.GridSpec, place: ports.Place) -> bool:
    """Whether the cell of ``free``, bool [height, width], at ``place`` is free, and on the map."""
    column, row = grid.cell(*place)
    return 0 <= column < grid.width and 0 <= row < grid.height and bool(free[row, column])
