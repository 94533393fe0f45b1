"""The growth of the robots' maps for a replay: who discovered a cell, and when each one knew it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from desim.monitor.map_growth import NEVER, MapGrowth
from desim.report.replay.columns import Columns
from desim.results.merged_map import merged

AROUND = 2  # cells to each side of the square whose most frequent discoverer colours the middle
MAX_CELLS = 8_000_000  # of all robots' own maps together; larger ones are kept more coarsely


def add_growth(columns: Columns, growth: Sequence[MapGrowth], robots: Sequence[str]
               ) -> tuple[dict[str, object] | None, str | None]:
    """Add the cells that somebody knew first, and each robot's own map. Their description (None: no
    robot had a map), and the sentence that says what was left out, if anything was."""
    if not growth:
        return None, None
    grid = growth[0].grid
    whole = merged(growth, robots)
    is_known = whole.known_since < NEVER
    _add_times(columns, "merged.known", np.minimum(whole.known_since, NEVER))
    columns.add("merged.robot", _held(_most_around(whole.discoverer, is_known), is_known))
    columns.add_bits("merged.occupied", (whole.occupied & is_known).ravel())
    factor = 1
    while len(growth) * (grid.width // factor) * (grid.height // factor) > MAX_CELLS:
        factor *= 2
    for k, life in enumerate(growth):
        _add_times(columns, f"growth.{k}.known", _coarse(life.known_since, factor))
        columns.add_bits(f"growth.{k}.occupied", _coarse(life.occupied, factor).ravel())
    about = {"x_m": grid.x_m, "y_m": grid.y_m, "resolution_m": grid.resolution_m,
             "width": grid.width, "height": grid.height, "factor": factor,
             "coarse": [-(-grid.width // factor), -(-grid.height // factor)]}
    if factor == 1:
        return about, None
    return about, (f"each robot's own map is kept in cells of {factor * grid.resolution_m:g} m, "
                   f"the merged one in cells of {grid.resolution_m:g} m")


def _most_around(first: np.ndarray, known: np.ndarray) -> np.ndarray:
    """[height, width] the most frequent discoverer among the known cells of the square around each
    cell; its own where that is as frequent. Fans of robots that stand together are stripes one cell
    wide, which nobody could tell apart."""
    robots = np.unique(first[known])
    most, out = np.zeros(first.shape, np.int64), first.copy()
    own = np.zeros(first.shape, np.int64)
    for robot in robots:
        cells = known & (first == robot)
        rows, columns = (np.flatnonzero(cells.any(axis=axis)) for axis in (1, 0))
        box = tuple(slice(max(0, int(found[0]) - AROUND), int(found[-1]) + AROUND + 1)
                    for found in (rows, columns))
        count = _count_around(cells[box])
        own[box][cells[box]] = count[cells[box]]
        more = count > most[box]
        most[box][more] = count[more]
        out[box][more] = robot
    return np.where(own == most, first, out)


def _count_around(cells: np.ndarray) -> np.ndarray:
    """[height, width] how many cells of the square around each one are set."""
    count = cells.astype(np.int64)
    for axis in (0, 1):
        padding = [(AROUND + 1, AROUND) if axis == k else (0, 0) for k in (0, 1)]
        summed = np.pad(count, padding).cumsum(axis=axis)
        size = count.shape[axis]
        count = (summed.take(range(2 * AROUND + 1, 2 * AROUND + 1 + size), axis=axis)
                 - summed.take(range(size), axis=axis))
    return count


def _add_times(columns: Columns, name: str, known: np.ndarray) -> None:
    """Add times with the unknown cells as bits, so that those between known ones cost nothing."""
    columns.add_bits(f"{name}.is", known.ravel() != NEVER)
    columns.add(name, _held(known, known != NEVER))


def _held(values: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """[n] the last valid value before each one that is not."""
    flat, valid = values.ravel(), valid.ravel()
    last = np.maximum.accumulate(np.where(valid, np.arange(flat.size), 0))
    return np.where(valid[last], flat[last], 0)


def _coarse(cells: np.ndarray, factor: int) -> np.ndarray:
    """Blocks of cells as one: the first that was known, or whether one is occupied."""
    if factor == 1:
        return cells
    height, width = (-(-size // factor) * factor for size in cells.shape)
    fill = NEVER if cells.dtype != bool else False
    padded = np.full((height, width), fill, cells.dtype)
    padded[:cells.shape[0], :cells.shape[1]] = cells
    blocks = padded.reshape(height // factor, factor, width // factor, factor)
    return blocks.max(axis=(1, 3)) if cells.dtype == bool else blocks.min(axis=(1, 3))
