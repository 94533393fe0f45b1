"""Walls and blocks between antennas.

A wall (up to ``BLOCK_M`` thick) counts once on a straight line through it. A thicker block counts
twice: where the line enters and where it leaves. Walls may be drawn or come from a map image; the
result is the same.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_opening, distance_transform_edt, maximum_filter

from desim.world import kernels

BLOCK_M = 1.0  # a castle's wall; the outer walls of houses are 0.2 to 0.5 m thick
FACE_M = 0.2  # a block's face, as thick as a wall of the paper's maps

# Two solid stretches of a line that are separated by less than this many cells (and by less than
# 1 m) are one wall: such gaps are the steps of a slanting wall, not doors.
GAP_CELLS = 2.0

# A line must be in a wall for at least half of its thickness, less this many cells (thicknesses are
# known to half a cell). Otherwise it only cuts the corner of a wall's end, beside the door, and
# would pass the drawn wall. Of walls that are one cell thick every touch counts: slanting lines may
# slip through between two of their cells.
SLACK_CELLS = 0.25

# Both are tuned on four houses with doors of 1 m, at 0, 30 and 45 degrees, in cells of 0.05 and
# 0.1 m: the coverage differs from that of the drawn houses by at most 1.8 % with walls of 0.2 m and
# 2.1 % with walls of 0.3 m. Where every touch counts by up to 3.0 %, and with gaps of 1 or 3 cells
# besides by up to 6.1 and 2.4 %. In cells of 0.2 m, as thick as the walls, by up to 4.2 %: doors
# are wider or narrower there.


class Matter(NamedTuple):
    """``segments`` [n, 4] x1 y1 x2 y2 in m | ``material`` [n] rows of ``materials.NAMES`` |
    ``thickness_m``, ``height_m`` [n] | ``block`` [n] bool: the face of a block, not a wall |
    ``crossing(segments, pairs)``: [c, 2] rows (pair, segment), sorted: what the straight lines
    ``pairs`` [k, 4] go through, of these ``segments`` and of others behind them."""

    segments: np.ndarray
    material: np.ndarray
    thickness_m: np.ndarray
    height_m: np.ndarray
    block: np.ndarray
    crossing: Callable[[np.ndarray, np.ndarray], np.ndarray]


def crossing(walls: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """[c, 2] rows (pair, wall), sorted: which of ``walls`` [n, 4] the straight lines ``pairs``
    [k, 4] cross."""
    pairs = np.ascontiguousarray(pairs, dtype=np.float64).reshape(-1, 4)
    return _all_found(kernels.crossings, len(pairs), walls, pairs)


def _all_found(kernel: Callable[..., int], lines: int, *given: object) -> np.ndarray:
    """What ``kernel`` puts into its last argument, and says how many rows there are of."""
    out = np.empty((max(64, 8 * lines), 2), dtype=np.int64)
    found = kernel(*given, out)
    if found > len(out):
        out = np.empty((found, 2), dtype=np.int64)
        kernel(*given, out)
    return out[:found]


# ---------------------------------------------------------------------------------------- in cells


@dataclass(frozen=True)
class Cells:
    """Solid cells between antennas. ``kinds`` [rows, cols]: 0 free, of material m 2 m + 1 in a wall
    and 2 m + 2 in a block, with a free border; ``least`` [rows, cols]: for how many cells a line
    must be in a wall that it crosses; ``keys`` [faces], ascending: where a face begins;
    ``origin_m`` is the corner of cell (0, 0)."""

    kinds: np.ndarray
    least: np.ndarray
    keys: np.ndarray
    origin_m: np.ndarray
    edge_m: float

    def __call__(self, segments: np.ndarray, pairs: np.ndarray) -> np.ndarray:
        """``Matter.crossing``. A wall's own segment is the face at one end of the line's way
        through it."""
        pairs = np.asarray(pairs, dtype=np.float64).reshape(-1, 4)
        lines = np.ascontiguousarray((pairs - np.tile(self.origin_m, 2)) / self.edge_m)
        gap = min(GAP_CELLS, BLOCK_M / self.edge_m)
        rows = _all_found(kernels.stretches, len(pairs), self.kinds, self.least, lines, gap)
        rows[:, 1] = np.searchsorted(self.keys, rows[:, 1], side="right") - 1
        others = crossing(segments[len(self.keys):], pairs) + (0, len(self.keys))
        rows = np.concatenate([rows, others])
        return rows[np.lexsort((rows[:, 1], rows[:, 0]))]


def of_cells(solid: np.ndarray, material: np.ndarray | int, edge_m: float,
             corner_m: tuple[float, float], height_m: float) -> Matter:
    """The matter of ``solid`` [rows, cols] cells of ``edge_m``, all of one material or each of
    ``material`` [rows, cols], with the corner of cell (0, 0) at ``corner_m``."""
    away_m = distance_transform_edt(solid) * edge_m if not solid.all() else np.full(solid.shape,
                                                                                    np.inf)
    block = _blocks(solid, away_m, edge_m)
    kinds = np.pad(np.where(solid, 2 * np.asarray(material) + 1 + block, 0).astype(np.int8), 1)
    keys, faces, at = _faces(kinds)
    origin_m = np.array(corner_m) - edge_m
    kind = kinds[at]
    thick_m = np.pad(_thickness_m(away_m, block, edge_m), 1)
    thickness_m = thick_m[at]
    wide = np.pad(binary_opening(solid, np.ones((2, 2))), 1) & (kinds % 2 == 1)
    least = np.where(wide, thick_m / edge_m / 2 - SLACK_CELLS, 0.0).astype(np.float32)
    return Matter(faces * edge_m + np.tile(origin_m, 2), (kind.astype(np.int64) - 1) // 2,
                  np.where(kind % 2, thickness_m, FACE_M), np.full(len(faces), height_m),
                  kind % 2 == 0, Cells(kinds, least, keys, origin_m, edge_m))


def _blocks(solid: np.ndarray, away_m: np.ndarray, edge_m: float) -> np.ndarray:
    """[rows, cols] bool: the cells of what a disc wider than ``BLOCK_M`` fits into, to its corners;
    ``away_m`` is how far the nearest free cell is, from middle to middle."""
    deep = away_m > (BLOCK_M + edge_m) / 2
    if not deep.any():
        return deep
    reach_m = np.sqrt(2) * (BLOCK_M / 2 + edge_m)
    return solid & (distance_transform_edt(~deep) * edge_m <= reach_m)


def _thickness_m(away_m: np.ndarray, block: np.ndarray, edge_m: float) -> np.ndarray:
    """[rows, cols] of walls, to half a cell: twice the way from their middle to what is free."""
    size = 2 * int(np.ceil(BLOCK_M / 2 / edge_m)) + 1
    return 2 * maximum_filter(np.where(block, 0.0, away_m), size) - edge_m / 2


def _faces(kinds: np.ndarray) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Where cells of a kind end, as long straight runs: their keys, corners [n, 4] in cells, and a
    cell (row, col) of each. Sides as ``kernels.stretches`` counts them: below the cell, above it,
    left and right of it."""
    span = max(kinds.shape) + 1
    keys, faces, cells = [], [], []
    for side in range(4):
        vertical, behind = divmod(side, 2)
        across = kinds.T if vertical else kinds
        kind = np.where(across[1:] != across[:-1], across[:-1] if behind else across[1:], 0)
        step = np.diff(np.pad(kind, ((0, 0), (1, 1))), axis=1) != 0
        line, begin = np.nonzero(step[:, :-1] & (kind > 0))
        _, end = np.nonzero(step[:, 1:] & (kind > 0))
        keys.append((side * span + line + 1) * span + begin)
        middle, cell = (begin + end) // 2, line + 1 - behind
        line, end = line + 1, end + 1
        faces.append(np.stack([line, begin, line, end] if vertical else [begin, line, end, line],
                              axis=1))
        cells.append((middle, cell) if vertical else (cell, middle))
    rows, cols = (np.concatenate(part) for part in zip(*cells, strict=True))
    return np.concatenate(keys), np.concatenate(faces), (rows, cols)
