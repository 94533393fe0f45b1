"""Draws bitmaps and polygons, wherever they lie and however they are turned, on one grid."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw

from desim.errors import InputError

_MOST_CELLS = 25_000_000
_HAIR = 1e-6  # of its size, within a polygon: a side between two cells is in the inner one


class Bitmap(NamedTuple):
    """``solid`` [rows, cols] bool, row 0 lowest, stretched to ``size_m`` around (x_m, y_m)."""

    solid: np.ndarray
    size_m: tuple[float, float]
    x_m: float
    y_m: float
    yaw_rad: float

    @property
    def pixel_m(self) -> float:
        """The shorter side of a pixel."""
        rows, cols = self.solid.shape
        return min(self.size_m[0] / cols, self.size_m[1] / rows)

    def points(self, along: np.ndarray, across: np.ndarray) -> np.ndarray:
        """[n, 2] m the points at shares of its width and depth, from its lower left corner."""
        cos, sin = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        x, y = (along - 0.5) * self.size_m[0], (across - 0.5) * self.size_m[1]
        return np.column_stack([self.x_m + cos * x - sin * y, self.y_m + sin * x + cos * y])

    @property
    def corners(self) -> np.ndarray:
        """[4, 2] m"""
        return self.points(np.array([0.0, 1.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0, 1.0]))


class DrawnGround(NamedTuple):
    """Cells [rows, cols] bool of ``cell_m``, row 0 lowest, and their lower left corner in m."""

    free: np.ndarray
    cell_m: float
    corner_m: tuple[float, float]


def draw(bitmaps: Sequence[Bitmap], polygons: Sequence[np.ndarray], cell_m: float) -> DrawnGround:
    """The ground with solid bitmaps and polygons [n, 2] m: a cell is solid if its centre is, or if
    it has the centre of a solid pixel or a part of a polygon. Raises ``InputError`` for too many
    cells."""
    corners = np.concatenate([*(bitmap.corners for bitmap in bitmaps), *polygons])
    low = corners.min(axis=0)
    cols, rows = np.ceil((corners.max(axis=0) - low) / cell_m - 1e-6).astype(int).clip(1)
    if int(cols) * int(rows) > _MOST_CELLS:
        raise InputError(f"--resolution: {cols} x {rows} cells of {cell_m:g} m are too many; "
                         f"allowed: {_MOST_CELLS}")
    solid = np.zeros((rows, cols), bool)
    for bitmap in bitmaps:
        _draw_bitmap(solid, bitmap, low, cell_m)
    image = Image.new("L", (int(cols), int(rows)))
    for polygon in polygons:
        inner = polygon + _HAIR * (polygon.mean(axis=0) - polygon)
        points = np.floor((inner - low) / cell_m)
        ImageDraw.Draw(image).polygon(list(map(tuple, points.tolist())), fill=1, outline=1)
    return DrawnGround(~(solid | (np.asarray(image) > 0)), cell_m, (float(low[0]), float(low[1])))


def _draw_bitmap(solid: np.ndarray, bitmap: Bitmap, low: np.ndarray, cell_m: float) -> None:
    rows, cols = bitmap.solid.shape
    x = low[0] + (np.arange(solid.shape[1]) + 0.5) * cell_m - bitmap.x_m
    y = (low[1] + (np.arange(solid.shape[0]) + 0.5) * cell_m - bitmap.y_m)[:, None]
    cos, sin = math.cos(bitmap.yaw_rad), math.sin(bitmap.yaw_rad)
    col = np.floor(((cos * x + sin * y) / bitmap.size_m[0] + 0.5) * cols).astype(int)
    row = np.floor(((cos * y - sin * x) / bitmap.size_m[1] + 0.5) * rows).astype(int)
    inside = (col >= 0) & (col < cols) & (row >= 0) & (row < rows)
    solid |= inside & bitmap.solid[row.clip(0, rows - 1), col.clip(0, cols - 1)]
    dark_row, dark_col = np.nonzero(bitmap.solid)
    centres = bitmap.points((dark_col + 0.5) / cols, (dark_row + 0.5) / rows)
    at_col, at_row = np.floor((centres - low) / cell_m).astype(int).T
    solid[at_row.clip(0, solid.shape[0] - 1), at_col.clip(0, solid.shape[1] - 1)] = True
