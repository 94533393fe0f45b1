"""The terrain: walls and solid matter, whatever source they come from."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from desim.errors import InputError
from desim.ports import GridSpec
from desim.world.geometry import (
    TOUCH_M,
    borders,
    outline,
    point_distance,
    rectangle,
    rows_of,
    segments,
)
from desim.world.kernels.flood import flood
from desim.world.obstacles import Matter, of_cells

FREE, WALL = 0, 1
# A map of more cells than this is refused: 1.6 km x 1.6 km at 0.2 m.
MAX_CELLS = 64_000_000
# So is one with more straight walls: scans of large buildings have some 100 000, with speckles.
MOST_WALLS = 2_000_000


@dataclass(frozen=True, eq=False)
class Raster:
    """Solid cells. ``solid`` [rows, cols] bool, row 0 lowest, sealed by a solid border;
    (x_m, y_m) is the lower left corner of cell (0, 0)."""

    solid: np.ndarray
    resolution_m: float
    x_m: float
    y_m: float

    def within(self, spec: GridSpec) -> np.ndarray:
        """[height, width] bool: the cells of ``spec`` that overlap a solid cell."""
        rows, cols = self.solid.shape
        by_row = np.array([self.solid[low:high].any(axis=0) for low, high in self._overlaps(
            rows, self.y_m, spec.height, spec.y_m, spec.resolution_m)])
        return np.array([by_row[:, left:right].any(axis=1) for left, right in self._overlaps(
            cols, self.x_m, spec.width, spec.x_m, spec.resolution_m)]).T

    def _overlaps(self, cells: int, from_m: float, others: int, other_from_m: float,
                  other_m: float) -> list[tuple[int, int]]:
        """Along an axis, the first cell that overlaps each of ``others``, and the one behind the
        last, by more than ``TOUCH_M``."""
        edges_m = np.arange(cells + 1) * self.resolution_m + from_m
        first = np.floor((edges_m[:-1] + TOUCH_M - other_from_m) / other_m)
        last = np.floor((edges_m[1:] - TOUCH_M - other_from_m) / other_m)
        return list(zip(np.searchsorted(last, np.arange(others), "left").tolist(),
                        np.searchsorted(first, np.arange(others), "right").tolist(), strict=True))


@dataclass(frozen=True)
class Terrain:
    """Walls and solid matter.

    ``walls`` [n, 4] x1 y1 x2 y2 in m, which bodies and beams meet | ``matter()`` for the radio,
    made at the first call for it | ``solids`` [k, 4] x0 y0 x1 y1 in m, solid rectangles |
    ``bounds`` x0 y0 x1 y1 | ``tops_m`` [n], ``solid_tops_m`` [k]: the heights of walls and solids;
    bounds have no end | ``raster`` if the terrain came as one; ``walls`` are its outline then |
    ``doubts``: what is likely to be wrong with the file that it came from.
    """

    name: str
    walls: np.ndarray
    matter: Callable[[], Matter]
    solids: np.ndarray
    bounds: tuple[float, float, float, float]
    tops_m: np.ndarray
    solid_tops_m: np.ndarray
    raster: Raster | None = None
    doubts: tuple[str, ...] = ()

    @property
    def lines(self) -> np.ndarray:
        """[n, 4] the walls that bodies and beams meet as lines; in a raster they meet its cells."""
        return self.walls if self.raster is None else self.walls[:0]

    def above(self, height_m: float) -> Terrain:
        """The terrain as it is met at this height: without what is not higher."""
        higher = self.tops_m > height_m
        if higher.all():
            return self
        if self.raster is not None:  # which is all of one height: its bounds remain
            rim = segments(rectangle(*self.bounds))
            return replace(self, walls=rim, tops_m=np.full(len(rim), np.inf), raster=None,
                           solids=self.solids[:0], solid_tops_m=self.solid_tops_m[:0])
        solid = self.solid_tops_m > height_m
        return replace(self, walls=self.walls[higher], tops_m=self.tops_m[higher],
                       solids=self.solids[solid], solid_tops_m=self.solid_tops_m[solid])

    def grid(self, resolution_m: float) -> GridSpec:
        """The raster for maps of this terrain: it covers the bounds, and the lines of walls run
        through the middle of cells (a raster terrain's own cells are kept as they are)."""
        x0, y0, x1, y1 = self.bounds
        margin = 0 if self.raster is not None else 1
        cols = math.ceil((x1 - x0) / resolution_m - TOUCH_M) + margin
        rows = math.ceil((y1 - y0) / resolution_m - TOUCH_M) + margin
        if cols * rows > MAX_CELLS:
            raise InputError(f"robot.mapping.resolution: {cols} x {rows} cells of {resolution_m} m "
                             f"are too many for terrain {self.name!r} (allowed: {MAX_CELLS})")
        shift = margin * resolution_m / 2
        return GridSpec(resolution_m, cols, rows, x0 - shift, y0 - shift)

    def truth(self, spec: GridSpec) -> np.ndarray:
        """[height, width] uint8: 0 free, 1 where a wall passes, matter is solid or the terrain has
        ended. A wall on the line between two cells is in both."""
        x0, y0, x1, y1 = self.bounds
        x_m = spec.x_m + (np.arange(spec.width) + 0.5) * spec.resolution_m
        y_m = spec.y_m + (np.arange(spec.height) + 0.5) * spec.resolution_m
        inside = ((y_m > y0) & (y_m < y1))[:, None] & (x_m > x0) & (x_m < x1)
        truth = np.where(inside, FREE, WALL).astype(np.uint8)
        if self.raster is not None:
            return truth | self.raster.within(spec)
        for x0, y0, x1, y1 in self.solids.tolist():
            left, low = spec.cell(x0 + TOUCH_M, y0 + TOUCH_M)
            right, high = spec.cell(x1 - TOUCH_M, y1 - TOUCH_M)
            truth[max(low, 0):max(high + 1, 0), max(left, 0):max(right + 1, 0)] = WALL
        for wall in _both_sides(self.lines):
            cols, rows = _cells_along(wall, spec)
            truth[rows, cols] = WALL
        return truth

    def reachable(self, spec: GridSpec, starts: np.ndarray) -> np.ndarray:
        """[height, width] bool: G, the free cells that a laser can come to see from ``starts``
        [n, 2] m. Free cells join along their sides; solid cores stay out.

        Raises ``InputError`` if there is no such cell.
        """
        truth = self.truth(spec)
        reachable = np.zeros(truth.shape, bool)
        cells = [np.ravel_multi_index(_free_cell(truth, spec, x, y), truth.shape)
                 for x, y in starts.tolist()]
        flood(truth == FREE, np.array(cells, np.int64), reachable.ravel(),
              np.empty(truth.size, np.int32))
        if not reachable.any():
            raise InputError(f"environment.terrain: no free cell of {spec.resolution_m} m of "
                             f"{self.name!r} can be reached from the start positions; use a finer "
                             "mapping resolution or other starts")
        return reachable

    def clearance(self, points: np.ndarray, reach_m: float) -> np.ndarray:
        """[k] m from ``points`` [k, 2] to the nearest wall, at most ``reach_m``; -1 in solid matter
        and outside the bounds."""
        low, high = points.min(axis=0) - reach_m, points.max(axis=0) + reach_m
        x, y = self.walls[:, 0::2], self.walls[:, 1::2]
        near = ((x.max(axis=1) > low[0]) & (x.min(axis=1) < high[0])
                & (y.max(axis=1) > low[1]) & (y.min(axis=1) < high[1]))
        clear = np.full(len(points), reach_m)
        if near.any():
            clear = np.minimum(clear, point_distance(points, self.walls[near]).min(axis=1))
        return np.where(self._inside_matter(points), -1.0, clear)

    def _inside_matter(self, points: np.ndarray) -> np.ndarray:
        x, y = points.T
        x0, y0, x1, y1 = self.bounds
        inside = ~((x > x0) & (x < x1) & (y > y0) & (y < y1))
        if (cells := self.raster) is not None:
            rows, cols = cells.solid.shape
            col = np.floor((x - cells.x_m) / cells.resolution_m).astype(int).clip(0, cols - 1)
            row = np.floor((y - cells.y_m) / cells.resolution_m).astype(int).clip(0, rows - 1)
            return inside | cells.solid[row, col]
        left, low, right, high = self.solids.T[:, :, None]
        return inside | ((x > left) & (x < right) & (y > low) & (y < high)).any(axis=0)


def from_raster(name: str, raster: Raster, material: np.ndarray | int, height_m: float) -> Terrain:
    """A terrain of solid cells, all of one material or each of ``material`` [rows, cols]."""
    edge = raster.resolution_m
    origin = np.array([raster.x_m, raster.y_m, raster.x_m, raster.y_m])
    walls = outline(raster.solid) * edge
    walls += origin
    rows, cols = raster.solid.shape
    matter = partial(of_cells, raster.solid, material, edge, (raster.x_m, raster.y_m), height_m)
    solids = rows_of(raster.solid) * edge + origin
    return Terrain(name=name, walls=walls, matter=matter, solids=solids,
                   tops_m=np.full(len(walls), height_m),
                   solid_tops_m=np.full(len(solids), height_m),
                   bounds=(raster.x_m, raster.y_m, raster.x_m + cols * edge,
                           raster.y_m + rows * edge), raster=raster)


def of_free_cells(path: Path, free: np.ndarray, material: np.ndarray | int, edge_m: float,
                  corner_m: tuple[float, float], height_m: float) -> Terrain:
    """The terrain of the part of ``free`` [rows, cols] with free cells in it, row 0 lowest, closed
    by a solid border of one cell; ``corner_m`` is that of cell (0, 0). A border outside of ``free``
    is of the material [rows, cols] beside it. Raises ``InputError`` about the file ``path``."""
    rows, cols = np.flatnonzero(free.any(axis=1)), np.flatnonzero(free.any(axis=0))
    part = slice(rows[0], rows[-1] + 3), slice(cols[0], cols[-1] + 3)  # of one with a border
    solid = np.ascontiguousarray(np.pad(~free, 1, constant_values=True)[part])
    if (walls := borders(solid)) > MOST_WALLS:
        raise InputError(f"{path}: {walls} straight walls are too many (allowed: {MOST_WALLS}); "
                         "is it noise?")
    raster = Raster(solid, edge_m, corner_m[0] + (int(cols[0]) - 1) * edge_m,
                    corner_m[1] + (int(rows[0]) - 1) * edge_m)
    if isinstance(material, np.ndarray):
        material = np.pad(material, 1, mode="edge")[part]
    return from_raster(path.stem, raster, material, height_m)


def _both_sides(walls: np.ndarray) -> np.ndarray:
    """[2 n, 4] each wall moved to either side by a hair, so that rounding decides nothing."""
    along = walls[:, 2:] - walls[:, :2]
    along = along / np.hypot(along[:, 0], along[:, 1])[:, None]
    aside = np.column_stack([-along[:, 1], along[:, 0]] * 2) * TOUCH_M
    return np.concatenate([walls + aside, walls - aside])


def _cells_along(wall: np.ndarray, spec: GridSpec) -> tuple[np.ndarray, np.ndarray]:
    """(cols, rows) of the cells that a wall passes: one between two crossings of grid lines."""
    start = (wall[:2] - (spec.x_m, spec.y_m)) / spec.resolution_m
    end = (wall[2:] - (spec.x_m, spec.y_m)) / spec.resolution_m
    cuts = [np.array([0.0, 1.0])]
    for axis in (0, 1):
        low, high = sorted((start[axis], end[axis]))
        lines = np.arange(math.ceil(low), math.floor(high) + 1)
        if high > low:
            cuts.append(((lines - start[axis]) / (end[axis] - start[axis])).clip(0.0, 1.0))
    along = np.unique(np.concatenate(cuts))
    middle = (along[1:] + along[:-1]) / 2
    cols, rows = np.floor(start[:, None] + (end - start)[:, None] * middle).astype(int)
    inside = (cols >= 0) & (cols < spec.width) & (rows >= 0) & (rows < spec.height)
    return cols[inside], rows[inside]


def _free_cell(truth: np.ndarray, spec: GridSpec, x_m: float, y_m: float) -> tuple[int, int]:
    """(row, col) of the cell of the point, or of the nearest free one of those around it."""
    col, row = spec.cell(x_m, y_m)
    around = [(row + dr, col + dc) for dr in (-1, 0, 1) for dc in (-1, 0, 1)
              if 0 <= row + dr < spec.height and 0 <= col + dc < spec.width]
    free = [cell for cell in around if truth[cell] == FREE]
    if (row, col) in free or not free:
        return (min(max(row, 0), spec.height - 1), min(max(col, 0), spec.width - 1))
    return min(free, key=lambda cell: (
        (spec.x_m + (cell[1] + 0.5) * spec.resolution_m - x_m) ** 2
        + (spec.y_m + (cell[0] + 0.5) * spec.resolution_m - y_m) ** 2, cell))

