"""Terrain drawn with characters: posts and walls between cells, or solid blocks."""

import numpy as np

from desim.errors import InputError
from desim.scenario.schema.environment import Drawing
from desim.world.geometry import outline, rows_of, segments

Point = tuple[float, float]


# Walls [n, 4] and solids [k, 4] as in ``Terrain``; the solid blocks as cells [rows, cols] bool
# (None: the drawing is of walls).
Drawn = tuple[np.ndarray, np.ndarray, np.ndarray | None]


def draw(drawing: Drawing, size_m: Point, centre_m: Point, what: str) -> Drawn:
    """The drawing in m, around ``centre_m``.

    Raises ``InputError``, beginning with ``what``, for a ragged drawing, a wrong character and a
    size that is not ``size_m``.
    """
    read = _walls if drawing.style == "walls" else _blocks
    extent, (walls, solids, cells) = read(drawing.lines, what)
    for axis, name, count, size in ((0, "wide", extent[0], size_m[0]),
                                    (1, "deep", extent[1], size_m[1])):
        drawn_m = count * drawing.cell_m
        if abs(drawn_m - size) > 1e-6:
            raise InputError(f"{what}: it is {count} cell{'s' * (count != 1)} of "
                             f"{drawing.cell_m:g} m {name}, {drawn_m:g} m, but "
                             f"size[{axis}] is {size:g} m")
    corner = np.tile(np.array(centre_m) - np.array(size_m) / 2, 2)
    return walls * drawing.cell_m + corner, solids * drawing.cell_m + corner, cells


def _walls(lines: tuple[str, ...], what: str) -> tuple[tuple[int, int], Drawn]:
    """Posts '+', walls '--' and '|' between cells; coordinates in cells from the lower left."""
    rows, cols = (len(lines) - 1) // 2, (len(lines[0]) - 1) // 3
    if len(lines) % 2 == 0 or len(lines[0]) % 3 != 1 or not rows or not cols:
        raise InputError(f"{what}: a drawing of walls has 2 n + 1 lines of 3 m + 1 characters, "
                         f"not {len(lines)} lines of {len(lines[0])}")
    walls = []
    for i, line in enumerate(lines):
        full = line.ljust(len(lines[0]))
        if len(full) != len(lines[0]):
            raise InputError(f"{what}.lines.{i}: has {len(line)} characters, the first line "
                             f"has {len(lines[0])}")
        y = rows - i / 2
        for col in range(cols + 1):
            post, between = full[3 * col], full[3 * col + 1:3 * col + 3]
            if i % 2 == 0:
                _expect(post, "+- ", f"{what}.lines.{i}", 3 * col)
                _expect(between, ("--", "  ", ""), f"{what}.lines.{i}", 3 * col + 1)
                if between == "--":
                    walls.append((col, y, col + 1, y))
            else:
                _expect(post, "| ", f"{what}.lines.{i}", 3 * col)
                _expect(between, ("  ", ""), f"{what}.lines.{i}", 3 * col + 1)
                if post == "|":
                    walls.append((col, y - 0.5, col, y + 0.5))
    return (cols, rows), (segments(walls), segments([]), None)


def _expect(found: str, allowed: str | tuple[str, ...], what: str, column: int) -> None:
    if found not in tuple(allowed):
        shown = ", ".join(repr(option) for option in allowed if option)
        raise InputError(f"{what}: column {column + 1} has {found!r} where only {shown} can stand")


def _blocks(lines: tuple[str, ...], what: str) -> tuple[tuple[int, int], Drawn]:
    """'#' solid, '.' and ' ' free; short lines end free."""
    for i, line in enumerate(lines):
        for column, char in enumerate(line):
            _expect(char, "#. ", f"{what}.lines.{i}", column)
    width = max(len(line) for line in lines)
    solid = np.array([[char == "#" for char in line.ljust(width)] for line in reversed(lines)])
    return (width, len(lines)), (outline(solid).astype(float), rows_of(solid).astype(float), solid)
