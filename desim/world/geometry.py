"""Plane geometry in numpy: straight walls as rows x1 y1 x2 y2, and rasters of solid cells."""

from collections.abc import Iterable

import numpy as np

# Walls closer than this to one line or to each other's ends count as one wall.
TOUCH_M = 1e-6


Row = tuple[float, float, float, float]


def rectangle(x0: float, y0: float, x1: float, y1: float) -> list[Row]:
    """The four sides of a rectangle, counterclockwise."""
    return [(x0, y0, x1, y0), (x1, y0, x1, y1), (x1, y1, x0, y1), (x0, y1, x0, y0)]


def segments(rows: Iterable[Row]) -> np.ndarray:
    """Rows x1 y1 x2 y2 as an array [n, 4], for n = 0 too."""
    return np.array(list(rows), dtype=np.float64).reshape(-1, 4)


def merge_collinear(walls: np.ndarray) -> np.ndarray:
    """Walls of one line that overlap or touch become one. ``walls`` [n, 4] m, none of length 0.

    The result [m, 4] is sorted by direction, offset and place: the order of declaration does not
    matter.
    """
    lines: dict[tuple[float, float], list[tuple[float, float]]] = {}
    for x1, y1, x2, y2 in walls.tolist():
        length = np.hypot(x2 - x1, y2 - y1)
        ux, uy = (x2 - x1) / length, (y2 - y1) / length
        if (round(ux, 9), round(uy, 9)) < (0.0, 0.0):
            ux, uy = -ux, -uy
        along = sorted((ux * x1 + uy * y1, ux * x2 + uy * y2))
        line = (round(float(np.arctan2(uy, ux)), 9), round((ux * y1 - uy * x1) / TOUCH_M) * TOUCH_M)
        lines.setdefault(line, []).append((along[0], along[1]))
    merged = []
    for (angle, offset), spans in sorted(lines.items()):
        ux, uy = np.cos(angle), np.sin(angle)
        for start, end in _union(sorted(spans)):
            merged.append((ux * start - uy * offset, uy * start + ux * offset,
                           ux * end - uy * offset, uy * end + ux * offset))
    return segments(np.round(merged, 9) + 0.0) if merged else segments([])


def _union(spans: list[tuple[float, float]]) -> list[tuple[float, float]]:
    joined = [spans[0]]
    for start, end in spans[1:]:
        if start <= joined[-1][1] + TOUCH_M:
            joined[-1] = (joined[-1][0], max(joined[-1][1], end))
        else:
            joined.append((start, end))
    return joined


def point_distance(points: np.ndarray, walls: np.ndarray) -> np.ndarray:
    """[k, n] m from each of ``points`` [k, 2] to each of ``walls`` [n, 4]."""
    px, py = points[:, 0, None], points[:, 1, None]
    x1, y1, x2, y2 = walls.T
    dx, dy = x2 - x1, y2 - y1
    length2 = dx * dx + dy * dy
    along = ((px - x1) * dx + (py - y1) * dy) / np.where(length2 > 0.0, length2, 1.0)
    along = np.clip(along, 0.0, 1.0)
    return np.hypot(px - x1 - along * dx, py - y1 - along * dy)


def outline(solid: np.ndarray) -> np.ndarray:
    """The border between solid and free cells as long straight runs.

    ``solid`` [rows, cols] bool | returns [n, 4] int corners x1 y1 x2 y2 in cells, horizontal runs
    first. The outer edge of the raster is no border.
    """
    runs = []
    for vertical, cells in ((False, solid), (True, solid.T)):
        line, start, end = _runs(cells[1:] != cells[:-1])
        at = line + 1
        runs.append(np.stack([at, start, at, end] if vertical else [start, at, end, at], axis=1))
    return np.concatenate(runs)


def borders(solid: np.ndarray) -> int:
    """The number of runs that ``outline`` finds."""
    return sum(int(np.count_nonzero(_steps(cells[1:] != cells[:-1]) == 1))
               for cells in (solid, solid.T))


def rows_of(solid: np.ndarray) -> np.ndarray:
    """Solid cells as horizontal strips: [k, 4] int x0 y0 x1 y1 in cells."""
    row, start, end = _runs(solid)
    return np.stack([start, row, end, row + 1], axis=1)


def _runs(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Row, first column and column behind the last of each run of true cells."""
    step = _steps(cells)
    row, start = np.nonzero(step == 1)
    return row, start, np.nonzero(step == -1)[1]


def _steps(cells: np.ndarray) -> np.ndarray:
    """[rows, cols + 1] int8: 1 where a run of true cells starts, -1 behind its end."""
    return np.diff(np.pad(cells, ((0, 0), (1, 1))).view(np.int8), axis=1)
