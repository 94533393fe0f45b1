"""Places that are drawn from a robot's map, for those that roam."""

from __future__ import annotations

import numpy as np

from desim import ports


def random_places(robot: ports.StrategyContext, draws: np.random.Generator, count: int
                  ) -> list[ports.Place]:
    """Those of ``count`` cells of the free map, drawn with equal chances, to which there is a path.
    """
    grid = robot.grid
    rows, columns = np.nonzero(robot.occupancy() == 0)
    if not len(rows):
        return []
    chosen = draws.integers(len(rows), size=count)
    places = [ports.Place(float(grid.x_m + (columns[k] + 0.5) * grid.resolution_m),
                          float(grid.y_m + (rows[k] + 0.5) * grid.resolution_m)) for k in chosen]
    return [place for place, length_m in zip(places, robot.path_lengths_m(places), strict=True)
            if np.isfinite(length_m)]
