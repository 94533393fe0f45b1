"""Points of a footprint, from which the local planner measures distances to obstacles."""

from __future__ import annotations

import math

import numpy as np

from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.footprint import sides


def cover(body: BodyType, cell_m: float) -> np.ndarray:
    """[k, 3] points of the footprint, at most ``cell_m`` apart: x, y in m, and by how much the
    distance from the outline is larger than the inscribed radius. base_local_planner's
    ``footprintCost`` takes those on the outline; those inside tell how deep an obstacle is in it. A
    disc has none."""
    corners = np.array(body.corners_m).reshape(-1, 2)
    if not len(corners):
        return np.zeros((0, 3))
    rim = [np.add(a, np.outer(np.arange(count) / count, np.subtract(b, a)))
           for a, b in sides(body.corners_m)
           for count in (math.ceil(math.dist(a, b) / cell_m),)]
    reach = math.ceil(np.abs(corners).max() / cell_m)
    line = cell_m * np.arange(-reach, reach + 1)
    lattice = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    points = np.concatenate([*rim, lattice[_depth_m(corners, lattice) > 0.0]])
    deep_m = np.maximum(_depth_m(corners, points), 0.0)
    return np.column_stack([points, deep_m - body.inscribed_radius_m])


def _depth_m(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """[k] m from ``points`` [k, 2] to the line of the nearest side; negative outside."""
    along = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack([along[:, 1], -along[:, 0]])
    normals /= np.hypot(along[:, 0], along[:, 1])[:, None]
    return ((normals * corners).sum(axis=1) - points @ normals.T).min(axis=1)
