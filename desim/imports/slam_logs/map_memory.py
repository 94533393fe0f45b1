"""The memory that the map of a log takes: a log whose map does not fit is refused."""

from __future__ import annotations

import math
from pathlib import Path

from desim.errors import InputError
from desim.imports.slam_logs.laser_log import LaserLog
from desim.robot.slam.kernels.tiles import CELLS

_MOST_BYTES = 1e9
_COARSEST_M = 2.0  # of ``desim slam --resolution``
# Of each cell of the rectangle, seen or not: visits and returns of the final map (int16), and its
# occupancy (int8). Of each tile: two indices (int32) a particle, twice while tables grow.
_CELL_BYTES = 2 + 2 + 1
_TILE_BYTES = 2 * 2 * 4


def check_memory(path: Path, log: LaserLog, resolution_m: float, particles: int) -> None:
    """Raises ``InputError`` unless the maps of all particles fit into memory, by the odometry of
    ``log`` and the laser's range."""
    low, high = log.odometry[:, :2].min(0).tolist(), log.odometry[:, :2].max(0).tolist()
    sides_m = [last - first + 2.0 * log.laser.longest_m
               for first, last in zip(low, high, strict=True)]
    across, up = (side_m / resolution_m for side_m in sides_m)
    needed = across * up * (_CELL_BYTES + particles * _TILE_BYTES / CELLS)
    if needed <= _MOST_BYTES:
        return
    wide_m = math.ceil(100.0 * min(resolution_m * math.sqrt(needed / _MOST_BYTES), 1e9)) / 100.0
    coarser = f", with --resolution {wide_m:g}" if wide_m <= _COARSEST_M else ""
    raise InputError(f"{path}: the map is {sides_m[0]:.5g} m x {sides_m[1]:.5g} m large by its "
                     f"odometry; in cells of {resolution_m:g} m it takes {needed / 1e6:.5g} MB; "
                     f"allowed: up to {_MOST_BYTES / 1e6:g} MB{coarser}")
