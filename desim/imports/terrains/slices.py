"""Footprints of solids: the outlines, in plan, of what of them lies between two heights."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw

from desim.world.geometry import rows_of

_SOLID = 0.8  # of its hull: a section of a mesh that fills more of it counts as convex
_STRAIGHT_M2 = 1e-6  # the area of two sides of an outline that count as one
_CLOSED_M = 1e-3  # ends of a section's sides that lie closer are one
_WELD_M = 1e-4  # corners of triangles that lie closer are one
_MOST_CELLS = 4_000  # of an outline, along a side


class Slab(NamedTuple):
    """The heights between which robots meet what is there."""

    low_m: float
    high_m: float


class Footprint(NamedTuple):
    """A solid polygon [n, 2] m, of two corners for a sheet, and the height of its top."""

    corners: np.ndarray
    top_m: float


def of_convex(points: np.ndarray, slab: Slab) -> Footprint | None:
    """The footprint of the convex hull of ``points`` [n, 3] m; None outside of the slab."""
    pairs = np.stack(np.broadcast_arrays(points[:, None], points), axis=2).reshape(-1, 2, 3)
    return _hull(_within(pairs, slab), points[:, 2].max())


def of_mesh(triangles: np.ndarray, slab: Slab, cell_m: float) -> Iterator[Footprint]:
    """The footprints of triangles [n, 3, 3] m: each part that hangs together is its hull where it
    is solid and convex; all others are as many rectangles of cells as they take, filled if all
    sections are closed."""
    parts = [part for part in _parts(triangles)
             if part[..., 2].max() > slab.low_m and part[..., 2].min() < slab.high_m]
    sections = [_section(part, (max(part[..., 2].min(), slab.low_m)
                                + min(part[..., 2].max(), slab.high_m)) / 2) for part in parts]
    has_hollows = any(_area(section) < 0.0 for section in sections)
    others = []
    for part, section in zip(parts, sections, strict=True):
        edges = part[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2, 3)
        hull = _hull(_within(edges, slab), part[..., 2].max())
        if hull is not None and not has_hollows and (
                len(hull.corners) < 3
                or _is_closed(section) and _area(section) >= _SOLID * _area(_around(hull.corners))):
            yield hull
        elif hull is not None:
            others.append((part, section))
    if others:
        rest, cuts = (np.concatenate(pieces) for pieces in zip(*others, strict=True))
        yield from _in_cells(rest, cuts if all(map(_is_closed, sections)) else cuts[:0], slab,
                             cell_m)


def _within(edges: np.ndarray, slab: Slab) -> np.ndarray:
    """[k, 2] the ends of ``edges`` [n, 2, 3] in the slab, and where they enter and leave it."""
    ends = edges.reshape(-1, 3)
    found = [ends[(ends[:, 2] >= slab.low_m) & (ends[:, 2] <= slab.high_m), :2]]
    start, end = edges[:, 0], edges[:, 1]
    for height in slab:
        across = (start[:, 2] - height) * (end[:, 2] - height) < 0.0
        a, b = start[across], end[across]
        found.append(a[:, :2] + (b - a)[:, :2] * ((height - a[:, 2]) / (b - a)[:, 2])[:, None])
    return np.concatenate(found)


def _hull(points: np.ndarray, top_m: float) -> Footprint | None:
    """The convex hull of ``points`` [n, 2], anticlockwise (Andrew's monotone chain, 1979)."""
    rows = sorted(set(map(tuple, np.round(points, 6).tolist())))
    if len(rows) < 2:
        return None

    def chain(corners: list[tuple[float, float]]) -> list[tuple[float, float]]:
        kept: list[tuple[float, float]] = []
        for x, y in corners:
            while len(kept) > 1:
                (x0, y0), (x1, y1) = kept[-2:]
                if (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) > _STRAIGHT_M2:
                    break
                kept.pop()
            kept.append((x, y))
        return kept[:-1]

    return Footprint(np.array(chain(rows) + chain(rows[::-1])), float(top_m))


def _parts(triangles: np.ndarray) -> Iterator[np.ndarray]:
    """The triangles that hang together by their corners."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    corners = np.round(triangles.reshape(-1, 3) / _WELD_M).astype(np.int64)
    _, welded = np.unique(corners, axis=0, return_inverse=True)
    a, b, c = welded.reshape(-1, 3).T
    links = np.concatenate([a, b]), np.concatenate([b, c])
    count, part = connected_components(coo_array(
        (np.ones(len(links[0]), np.int8), links), shape=(len(corners), len(corners))), False)
    order = np.argsort(part[a], kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(part[a][order])) + 1):
        yield triangles[rows]


def _section(triangles: np.ndarray, height_m: float) -> np.ndarray:
    """[n, 2, 2] the sides of the section of a mesh at a height, with what is solid on their left:
    each triangle that is cut gives one."""
    sides = []
    for turn in range(3):
        a, b, c = np.roll(triangles, turn, axis=1).transpose(1, 0, 2)
        for over, one, other in ((1.0, b, c), (-1.0, c, b)):  # a is alone above it, or below
            alone = ((a[:, 2] - height_m) * over > 0.0) & ((one[:, 2] - height_m) * over <= 0.0) & (
                (other[:, 2] - height_m) * over <= 0.0)
            sides.append(np.stack([
                a[alone, :2] + (end - a)[alone, :2] * ((height_m - a[alone, 2])
                                                       / (end[alone, 2] - a[alone, 2]))[:, None]
                for end in (one, other)], axis=1))
    return np.concatenate(sides)


def _around(corners: np.ndarray) -> np.ndarray:
    """[n, 2, 2] the sides of a polygon."""
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)


def _is_closed(sides: np.ndarray) -> bool:
    """Whether as many of the oriented ``sides`` begin as end at each of their corners."""
    corners, at = np.unique(np.round(sides.reshape(-1, 2) / _CLOSED_M), axis=0, return_inverse=True)
    change = np.bincount(at.ravel(), np.tile([1, -1], len(sides)), len(corners))
    return not change.any()


def _area(sides: np.ndarray) -> float:
    """The area that oriented ``sides`` [n, 2, 2] enclose (Green's theorem)."""
    (x0, y0), (x1, y1) = sides.transpose(1, 2, 0)
    return float((x0 * y1 - x1 * y0).sum()) / 2


def _filled(sides: np.ndarray, rows: int, cols: int) -> np.ndarray:
    """[rows, cols] bool: the cells whose centres closed oriented ``sides`` [n, 2, 2], in cells,
    wind around anticlockwise. A row that they do not close is left empty."""
    turns = np.zeros((rows, cols + 1), int)
    for (x0, y0), (x1, y1) in sides.tolist():
        first, last = sorted((round(y0), round(y1)))
        if first < last:
            row = np.arange(first, last)
            x = x0 + (row + 0.5 - y0) / (y1 - y0) * (x1 - x0)
            np.add.at(turns, (row, np.rint(x).astype(int).clip(0, cols)), 1 if y1 > y0 else -1)
    winding = turns[:, ::-1].cumsum(axis=1)[:, ::-1]
    return (winding[:, 1:] > 0) & (winding[:, :1] == 0)


def _in_cells(triangles: np.ndarray, section: np.ndarray, slab: Slab, cell_m: float,
              ) -> Iterator[Footprint]:
    """Rectangles of the cells that the triangles cover or touch in the slab, and of those that the
    section encloses. The faces of the mesh lie in the middle of cells."""
    pieces = [piece for triangle in triangles if len(piece := _clipped(triangle, slab)) > 1]
    corners = np.concatenate(pieces)
    cell_m = max(cell_m, float(np.ptp(corners, axis=0).max()) / _MOST_CELLS)
    low = corners.min(axis=0) - cell_m / 2
    cols, rows = np.floor((corners.max(axis=0) - low) / cell_m).astype(int) + 1
    image = Image.new("L", (int(cols), int(rows)))
    draw = ImageDraw.Draw(image)
    for piece in pieces:
        points = list(map(tuple, np.floor((piece - low) / cell_m).tolist()))
        draw.polygon(points, fill=1, outline=1)
        draw.line([*points, points[0]], fill=1)
    solid = (np.asarray(image) > 0) | _filled((section - low) / cell_m, rows, cols)
    top_m = float(triangles[..., 2].max())
    for x0, y0, x1, y1 in _rectangles(solid):
        corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)]) * cell_m + low
        yield Footprint(corners, top_m)


def _clipped(triangle: np.ndarray, slab: Slab) -> np.ndarray:
    """[k, 2] the corners, in order, of the part of a triangle in the slab."""
    corners = triangle
    for height, sign in ((slab.low_m, 1.0), (slab.high_m, -1.0)):
        kept = []
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            over_a, over_b = sign * (a[2] - height), sign * (b[2] - height)
            if over_a >= 0.0:
                kept.append(a)
            if over_a * over_b < 0.0:
                kept.append(a + (b - a) * over_a / (over_a - over_b))
        if not kept:
            return np.empty((0, 2))
        corners = np.array(kept)
    return corners[:, :2]


def _rectangles(solid: np.ndarray) -> list[tuple[int, int, int, int]]:
    """Rectangles x0 y0 x1 y1 that cover the solid cells: runs of a row, as long as they repeat."""
    found: list[tuple[int, int, int, int]] = []
    rising: dict[tuple[int, int], tuple[int, int]] = {}
    for x0, y0, x1, y1 in rows_of(solid).tolist():
        start = rising.pop((x0, x1), None)
        if start is not None and start[1] == y0:
            rising[x0, x1] = (start[0], y1)
        else:
            if start is not None:
                found.append((x0, start[0], x1, start[1]))
            rising[x0, x1] = (y0, y1)
    return found + [(x0, y0, x1, y1) for (x0, x1), (y0, y1) in rising.items()]
