"""Obstacles between antennas: walls and blocks, and which lines cross them.

A wall (up to ``BLOCK_M`` thick) counts once on a straight line through its centre line. A thicker
block counts twice: where the line enters and where it leaves. Walls may be drawn or come from a map
image; the result is the same.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from desim.world.kernels import crossings as kernels
from desim.world.wall_index import TileIndex, box_index, one_tile

BLOCK_M = 1.0  # a castle's wall; the outer walls of houses are 0.2 to 0.5 m thick
FACE_M = 0.2  # a block's face, as thick as a wall of the paper's maps

# Solid cells that are separated by less than this many cells (and by less than 1 m) are one wall:
# such gaps are the steps of a slanting wall, not doors.
GAP_CELLS = 2.0

_WORTH_TILES = 1 << 15  # tests of a line against a wall that take longer than an index (0.1 ms)


class Matter(NamedTuple):
    """``segments`` [n, 4] x1 y1 x2 y2 in m | ``material`` [n] rows of ``materials.NAMES`` |
    ``thickness_m``, ``height_m`` [n] | ``block`` [n] bool: the face of a block, not a wall |
    ``crossing(segments, pairs)``: [c, 2] rows (pair, segment), sorted: the crossings of the
    straight lines ``pairs`` [k, 4] with these ``segments`` and others behind them."""

    segments: np.ndarray
    material: np.ndarray
    thickness_m: np.ndarray
    height_m: np.ndarray
    block: np.ndarray
    crossing: Callable[[np.ndarray, np.ndarray], np.ndarray]


def crossing(walls: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """[c, 2] rows (pair, wall), sorted: the crossings of the straight lines ``pairs`` [k, 4] with
    ``walls`` [n, 4]."""
    pairs = np.ascontiguousarray(pairs, dtype=np.float64).reshape(-1, 4)
    if not len(walls) or not len(pairs):
        return np.empty((0, 2), dtype=np.int64)
    return _all_found(_find, len(pairs), walls, _index(walls, len(pairs)), pairs)


def _find(walls: np.ndarray, index: TileIndex, pairs: np.ndarray, out: np.ndarray) -> int:
    return kernels.crossings(walls, index.frame, index.start, index.items, pairs,
                             np.full(len(walls), -1), np.empty(len(walls), np.int64),
                             np.zeros(len(walls)), out)


def toll(walls: np.ndarray, pairs: np.ndarray, cost: np.ndarray, most: np.ndarray) -> np.ndarray:
    """As ``Obstacles.tolls``, of ``walls`` [n, 4]."""
    out = np.zeros(len(pairs))
    if len(walls) and len(pairs):
        index = _index(walls, len(pairs))
        kernels.tolls(walls, index.frame, index.start, index.items, np.ascontiguousarray(pairs),
                      np.full(len(walls), -1), np.empty(len(walls), np.int64), cost, most, out)
    return out


def _index(walls: np.ndarray, lines: int) -> TileIndex:
    """An index of ``walls`` that is worth its making for so many lines."""
    return box_index(walls, len(walls)) if len(walls) * lines > _WORTH_TILES else one_tile(walls)


def _all_found(kernel: Callable[..., int], lines: int, *given: object) -> np.ndarray:
    """The rows that ``kernel`` writes into its last argument; it returns their number."""
    out = np.empty((max(64, 32 * lines), 2), dtype=np.int64)  # of which only the rows found count
    found = kernel(*given, out)
    if found > len(out):
        out = np.empty((found, 2), dtype=np.int64)
        kernel(*given, out)
    return out[:found]


# ---------------------------------------------------------------------------------------- in cells


@dataclass(frozen=True)
class Cells:
    """Blocks and posts between antennas. ``kinds`` [rows, cols]: 0 free, of material m 2 m + 1 in a
    post and 2 m + 2 in a block, with a free border; ``keys`` [faces], ascending: where a face
    begins; ``origin_m`` is the corner of cell (0, 0)."""

    kinds: np.ndarray
    keys: np.ndarray
    origin_m: np.ndarray
    edge_m: float

    def __call__(self, segments: np.ndarray, pairs: np.ndarray) -> np.ndarray:
        """The crossings as in ``Matter.crossing``. A post's own segment is the face at one end of
        the line's way through it."""
        pairs = np.asarray(pairs, dtype=np.float64).reshape(-1, 4)
        rows = crossing(segments[len(self.keys):], pairs) + (0, len(self.keys))
        if not len(self.keys):
            return rows
        lines = np.ascontiguousarray((pairs - np.tile(self.origin_m, 2)) / self.edge_m)
        gap = min(GAP_CELLS, BLOCK_M / self.edge_m)
        faces = _all_found(kernels.stretches, len(pairs), self.kinds, lines, gap)
        faces[:, 1] = np.searchsorted(self.keys, faces[:, 1], side="right") - 1
        rows = np.concatenate([faces, rows])
        return rows[np.lexsort((rows[:, 1], rows[:, 0]))]


def of_cells(solid: np.ndarray, material: np.ndarray | int, edge_m: float,
             corner_m: tuple[float, float], height_m: float) -> Matter:
    """The matter of ``solid`` [rows, cols] cells of ``edge_m``, all of one material or each of
    ``material`` [rows, cols], with the corner of cell (0, 0) at ``corner_m``: the faces of blocks
    and posts, and the centre lines of walls."""
    # 0.1 s, which runs without solid cells do not need
    from scipy.ndimage import binary_closing, distance_transform_edt, maximum_filter

    from desim.world.centre_lines import centre_lines

    away_m = distance_transform_edt(solid) * edge_m if not solid.all() else np.full(solid.shape,
                                                                                    np.inf)
    block = _blocks(solid, away_m, edge_m)
    material = np.where(solid, material, -1)
    kinds = np.where(block, 2 * material + 2, 0).astype(np.int8)
    lines, thick_m, of_what = [np.zeros((0, 4))], [np.zeros(0)], [np.zeros(0, dtype=np.int64)]
    for one in np.unique(material[solid & ~block]).tolist():
        walls = (material == one) & ~block
        drawn, thickness, posts = centre_lines(
            walls if edge_m >= BLOCK_M  # else with the gaps filled that GAP_CELLS describes
            else binary_closing(np.pad(walls, 1), np.ones((2, 2)))[1:-1, 1:-1] & (walls | ~solid))
        kinds[posts & walls] = 2 * one + 1
        lines.append(drawn * edge_m + np.tile(corner_m, 2))
        thick_m.append(thickness * edge_m)
        of_what.append(np.full(len(drawn), one))
    kinds = np.pad(kinds, 1)
    keys, faces, at = _faces(kinds)
    kind = kinds[at].astype(np.int64)
    origin_m = np.array(corner_m) - edge_m
    # A post is as thick, to half a cell, as twice the way from its middle to the nearest free cell.
    widest = 2 * int(np.ceil(BLOCK_M / 2 / edge_m)) + 1
    post_m = (2 * np.pad(maximum_filter(np.where(block, 0.0, away_m), widest), 1)[at]
              - edge_m / 2)
    segments = np.concatenate([faces * edge_m + np.tile(origin_m, 2), *lines])
    return Matter(segments, np.concatenate([(kind - 1) // 2, *of_what]),
                  np.concatenate([np.where(kind % 2, post_m, FACE_M), *thick_m]),
                  np.full(len(segments), height_m),
                  np.pad(kind % 2 == 0, (0, len(segments) - len(kind))),
                  Cells(kinds, keys, origin_m, edge_m))


def _blocks(solid: np.ndarray, away_m: np.ndarray, edge_m: float) -> np.ndarray:
    """[rows, cols] bool: the cells of parts that a disc wider than ``BLOCK_M`` fits into, to their
    corners; ``away_m`` is the distance to the nearest free cell, from middle to middle."""
    deep = away_m > (BLOCK_M + edge_m) / 2
    if not deep.any():
        return deep
    from scipy.ndimage import distance_transform_edt

    reach_m = np.sqrt(2) * (BLOCK_M / 2 + edge_m)
    return solid & (distance_transform_edt(~deep) * edge_m <= reach_m)


def _faces(kinds: np.ndarray) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """The faces of cells of a kind, as long straight runs: their keys, corners [n, 4] in cells, and
    a cell (row, col) of each. Sides as ``kernels.stretches`` counts them: below the cell, above it,
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
