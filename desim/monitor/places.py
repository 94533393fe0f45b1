"""Places for tasks, given or drawn from the free space, and lines of sight between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from desim.errors import InputError
from desim.ports import Place
from desim.ports.tasks import Ground
from desim.units import LENGTH

_CANDIDATES = 32  # for each place


def free_cells(ground: Ground, starts_m: np.ndarray, clearance_m: float) -> np.ndarray:
    """[n, 2] m, the centres of the cells that are ``clearance_m`` away from all walls, and that can
    be reached from near one of ``starts_m`` [robots, 2] on a path with the same clearance."""
    from scipy import ndimage  # most runs do without it

    grid = ground.grid
    # From the middle of a cell to the middle of a wall's, whose edge is half a cell before.
    off_m = (ndimage.distance_transform_edt(ground.solid == 0) - 0.5) * grid.resolution_m
    wide = off_m >= clearance_m
    parts, _ = ndimage.label(wide & ground.reachable)
    if not parts.any():
        return np.zeros((0, 2))
    _, nearest = ndimage.distance_transform_edt(parts == 0, return_indices=True)
    at = [grid.cell(*start) for start in starts_m.tolist()]
    reached = {int(parts[tuple(nearest[:, row, column])]) for column, row in at}
    rows, columns = np.nonzero(np.isin(parts, sorted(reached)))
    return np.stack((grid.x_m + (columns + 0.5) * grid.resolution_m,
                     grid.y_m + (rows + 0.5) * grid.resolution_m), axis=1)


def drawn(cells_m: np.ndarray, count: int, generator: np.random.Generator) -> tuple[Place, ...]:
    """``count`` of ``cells_m`` [n, 2], spread out: each is, of some random candidates, the one that
    is farthest from all before it (best candidate, Mitchell 1991). Raises ``InputError`` if there
    are fewer cells."""
    if len(cells_m) < count:
        raise InputError(f".drawn: there are {len(cells_m)} places with this clearance, not "
                         f"{count}")
    chosen = cells_m[generator.integers(len(cells_m), size=1)]
    while len(chosen) < count:
        some = cells_m[generator.integers(len(cells_m), size=_CANDIDATES)]
        apart = np.hypot(*(some[:, None] - chosen).T).min(axis=0)
        chosen = np.append(chosen, some[[int(apart.argmax())]], axis=0)
    return tuple(Place(x_m, y_m) for x_m, y_m in chosen.tolist())


def trouble_at(ground: Ground, x_m: float, y_m: float) -> str | None:
    """The words for why nothing can be at a place, None if it is free."""
    column, row = ground.grid.cell(x_m, y_m)
    if not (0 <= column < ground.grid.width and 0 <= row < ground.grid.height):
        return "outside the terrain"
    return "inside a wall" if ground.solid[row, column] else None


def given(ground: Ground, places_m: Sequence[tuple[float, float]], key: str = "places"
          ) -> tuple[Place, ...]:
    """The places of the task's ``key``. Raises ``InputError`` for one that is in a wall, outside
    the terrain, or there twice."""
    for i, (x_m, y_m) in enumerate(places_m):
        at = f".{key}.{i}: {LENGTH.format(x_m)}, {LENGTH.format(y_m)} is"
        trouble = trouble_at(ground, x_m, y_m)
        if trouble:
            raise InputError(f"{at} {trouble}")
        if (x_m, y_m) in places_m[:i]:
            raise InputError(f"{at} {key}.{places_m.index((x_m, y_m))} already; allowed: each "
                             "place once")
    return tuple(Place(*place) for place in places_m)


def unobstructed(ground: Ground, one_m: np.ndarray, other_m: np.ndarray) -> bool:
    """Whether no wall is on the line between two points [2], looked at every half cell."""
    grid = ground.grid
    steps = 2 + int(np.hypot(*(other_m - one_m)) / (0.5 * grid.resolution_m))
    points_m = np.linspace(one_m, other_m, steps)
    columns = ((points_m[:, 0] - grid.x_m) / grid.resolution_m).astype(int)
    rows = ((points_m[:, 1] - grid.y_m) / grid.resolution_m).astype(int)
    return not ground.solid[rows.clip(0, grid.height - 1), columns.clip(0, grid.width - 1)].any()
