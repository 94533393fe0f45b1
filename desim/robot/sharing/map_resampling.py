"""Map resampling: the cells of one map in the raster of another one."""

from __future__ import annotations

import math

import numpy as np

from desim.ports import GridSpec, Pose2D


def resampled(grid: GridSpec, cells: np.ndarray, cell_m: float, corner_m: tuple[float, float],
              frame: Pose2D) -> tuple[int, int, np.ndarray]:
    """Row, column and log-odds in ``grid`` of int8 ``cells`` [rows, columns] of ``cell_m`` whose
    lower left corner is at ``corner_m`` of ``frame``: each cell has what is at its centre (nearest
    neighbour); what is beyond the grid is left out."""
    cos, sin = math.cos(frame.yaw_rad), math.sin(frame.yaw_rad)
    left_m, low_m = corner_m
    corners = [(left_m + cell_m * x, low_m + cell_m * y)
               for x in (0, cells.shape[1]) for y in (0, cells.shape[0])]
    columns = [(frame.x_m + cos * x_m - sin * y_m - grid.x_m) / grid.resolution_m
               for x_m, y_m in corners]
    rows = [(frame.y_m + sin * x_m + cos * y_m - grid.y_m) / grid.resolution_m
            for x_m, y_m in corners]
    first, last = _span(columns, grid.width)
    low, high = _span(rows, grid.height)
    x_m, y_m = np.meshgrid(
        grid.x_m + grid.resolution_m * (np.arange(first, last) + 0.5) - frame.x_m,
        grid.y_m + grid.resolution_m * (np.arange(low, high) + 0.5) - frame.y_m)
    column = np.floor((cos * x_m + sin * y_m - left_m) / cell_m).astype(int)
    row = np.floor((cos * y_m - sin * x_m - low_m) / cell_m).astype(int)
    inside = (row >= 0) & (row < cells.shape[0]) & (column >= 0) & (column < cells.shape[1])
    moved = np.zeros(row.shape, np.int8)
    moved[inside] = cells[row[inside], column[inside]]
    return low, first, moved


def _span(ends: list[float], size: int) -> tuple[int, int]:
    """The first cell of an extent, and the one behind its last, of ``size`` cells there are."""
    return (min(max(math.floor(min(ends)), 0), size), min(max(math.floor(max(ends)) + 1, 0), size))
