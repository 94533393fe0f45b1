"""A fleet on its terrain, as characters on a terminal."""

from __future__ import annotations

import math

import numpy as np
from rich.text import Text

from desim.monitor.monitor import Monitor
from desim.ports import GridSpec

_UNKNOWN, _EXPLORED, _WALL, _ROBOT = " ", "·", "▒", "●"
_STYLES = {_EXPLORED: "dim", _WALL: "dim", _ROBOT: "bold cyan"}
_TALL = 2  # a character is twice as high as wide


class FleetMap:
    """Draws the terrain of a run, what of it some robot knows, and the robots, as of the last full
    second; at most ``columns`` by ``rows`` characters."""

    def __init__(self, monitor: Monitor, columns: int, rows: int) -> None:
        self._monitor = monitor
        self._raster = CharacterGrid(monitor.truth.ground.grid, columns, rows)
        self._walls = self._raster.any(monitor.truth.ground.solid != 0)

    def draw(self) -> Text:
        """The map now."""
        monitor, raster = self._monitor, self._raster
        cells = np.full(self._walls.shape, _UNKNOWN)
        cells[raster.any(monitor.coverage.explored())] = _EXPLORED
        cells[self._walls] = _WALL
        if monitor.tracks:
            rows, columns = raster.cells(monitor.tracks[-1].poses[:, :2])
            cells[rows, columns] = _ROBOT
        return _styled(cells)


class CharacterGrid:
    """Squares of ``grid``, each for one character, ``_TALL`` times as high as wide; row 0 is at the
    top."""

    def __init__(self, grid: GridSpec, columns: int, rows: int) -> None:
        self._grid = grid
        across = max(math.ceil(grid.width / columns), math.ceil(grid.height / (rows * _TALL)), 1)
        self._across, self._up = across, across * _TALL
        self.shape = (math.ceil(grid.height / self._up), math.ceil(grid.width / across))

    def any(self, cells: np.ndarray) -> np.ndarray:
        """[rows, columns] bool: whether one of the ``cells``, bool [height, width], is set."""
        rows, columns = self.shape
        whole = np.zeros((rows * self._up, columns * self._across), bool)
        whole[:cells.shape[0], :cells.shape[1]] = cells
        squares = whole.reshape(rows, self._up, columns, self._across)
        return np.flipud(squares.any(axis=(1, 3)))

    def cells(self, places_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Row and column of each of ``places_m`` [n, 2]; the nearest where it lies outside."""
        grid, (rows, columns) = self._grid, self.shape
        cell = (places_m - (grid.x_m, grid.y_m)) / grid.resolution_m
        row = rows - 1 - np.floor(cell[:, 1] / self._up).astype(int)
        column = np.floor(cell[:, 0] / self._across).astype(int)
        return row.clip(0, rows - 1), column.clip(0, columns - 1)


def _styled(cells: np.ndarray) -> Text:
    text = Text("\n".join(map("".join, cells.tolist())), no_wrap=True)
    for character, style in _STYLES.items():
        text.highlight_regex(f"{character}+", style)
    return text
