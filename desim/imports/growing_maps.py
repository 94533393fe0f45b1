"""The growth of maps, from the occupancy grids of a ROS recording."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from desim.errors import InputError
from desim.export.ros.message_types import Message, Timed
from desim.monitor.map_growth import NEVER, TENTH_NS, MapGrowth
from desim.ports import GridSpec

_OCCUPIED = 50  # of 100
_MOST_CELLS = 1 << 26  # of one map: beyond it, a grid's numbers are damaged


class _Placed(NamedTuple):
    """A grid at a time: cells [height, width], and the column and row of its first cell."""

    time_ns: int
    column: int
    row: int
    cells: np.ndarray


class _Raster(NamedTuple):
    """The raster of the first grid, without an end."""

    resolution_m: float
    x_m: float
    y_m: float

    @classmethod
    def of(cls, message: Message) -> _Raster:
        # Resolutions come as float32: 0.05 as 0.05000000074505806.
        origin = message.info.origin.position
        return cls(float(f"{message.info.resolution:.6g}"), origin.x, origin.y)

    def placed(self, grids: list[Timed]) -> list[_Placed]:
        """Those of ``grids`` that fit: of this resolution, and with as many cells as they say."""
        found = []
        for time_ns, message in grids:
            info, own = message.info, _Raster.of(message)
            cells = np.asarray(message.data)
            if own.resolution_m == self.resolution_m and cells.size == info.width * info.height > 0:
                column, row = (round((place - first) / self.resolution_m) for place, first in
                               ((own.x_m, self.x_m), (own.y_m, self.y_m)))
                found.append(_Placed(time_ns, column, row,
                                     cells.reshape(info.height, info.width)))
        return found


def map_growths(robots: tuple[str, ...], end_ns: int, grids: Mapping[str, list[Timed]],
                robot_of: Callable[[str], str | None]) -> list[MapGrowth]:
    """The growth of each robot's map: a cell is known from the first grid on that knows it, and
    occupied as in the last one. All are put onto one raster, that of the first grid; maps of
    another resolution are left out."""
    own = {robot: found for topic, found in grids.items()
           if (robot := robot_of(topic)) is not None}
    if not own:
        return []
    raster = _Raster.of(next(iter(own.values()))[0][1])
    placed = {robot: raster.placed(found) for robot, found in own.items()}
    spec, corner = _extent(raster, [grid for found in placed.values() for grid in found])
    return [MapGrowth(robot, 0, end_ns, spec, *_grown(placed[robot], spec, corner))
            for robot in robots if placed.get(robot)]


def _extent(raster: _Raster, grids: list[_Placed]) -> tuple[GridSpec, tuple[int, int]]:
    """The smallest grid that holds all of ``grids``, and the column and row of its first cell.
    Raises ``InputError`` for one that is too large."""
    column = min((grid.column for grid in grids), default=0)
    row = min((grid.row for grid in grids), default=0)
    width = max((grid.column + grid.cells.shape[1] for grid in grids), default=0) - column
    height = max((grid.row + grid.cells.shape[0] for grid in grids), default=0) - row
    if width * height > _MOST_CELLS:
        raise InputError(f"its maps together have {width} x {height} cells; at most "
                         f"{_MOST_CELLS}")
    resolution_m = raster.resolution_m
    return GridSpec(resolution_m, width, height, raster.x_m + column * resolution_m,
                    raster.y_m + row * resolution_m), (column, row)


def _grown(grids: list[_Placed], spec: GridSpec, corner: tuple[int, int]
           ) -> tuple[np.ndarray, np.ndarray]:
    """[height, width] since when a cell is known (tenths of a second), and whether it is occupied.
    """
    since = np.full((spec.height, spec.width), NEVER, np.uint16)
    occupied = np.zeros((spec.height, spec.width), bool)
    for time_ns, column, row, cells in sorted(grids, key=lambda grid: grid.time_ns):
        left, low = column - corner[0], row - corner[1]
        place = slice(low, low + cells.shape[0]), slice(left, left + cells.shape[1])
        fresh = (cells >= 0) & (since[place] == NEVER)
        since[place][fresh] = min(max(time_ns, 0) // TENTH_NS, NEVER - 1)
        occupied[place] = np.where(cells >= 0, cells >= _OCCUPIED, occupied[place])
    return since, occupied
