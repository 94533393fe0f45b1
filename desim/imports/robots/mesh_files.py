"""Meshes that a robot's description names: those that lie beside it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from desim.files import content_below, name_in
from desim.imports.terrains import meshes

_MOST_BYTES = 100_000_000
_FOLDERS_ABOVE = 3  # a package is a folder or two above its description
_DIRECTIONS = 64  # in plan, in which a mesh's outermost corners are kept


def corners(description: Path, uri: str) -> np.ndarray:
    """[n, 3] the corners of a mesh in its own units. Of its path the longest end is taken that is
    below the description's folder, or else below the nearest one above it: that of its package.
    Raises ``OSError`` and ``ValueError``."""
    path = "/" + uri.rpartition("://")[2].lstrip("/")
    here = description.absolute().parent
    for folder in [here, *here.parents][:_FOLDERS_ABOVE]:
        name = name_in(folder, path)
        if not name.startswith("/"):
            return meshes.triangles(name, content_below(folder, name, _MOST_BYTES)).reshape(-1, 3)
    raise FileNotFoundError(uri)


def outermost(points: np.ndarray) -> np.ndarray:
    """[k, 3] those of many ``points`` [n, 3] that reach farthest in plan, upwards and downwards."""
    turns = np.arange(_DIRECTIONS) * 2.0 * np.pi / _DIRECTIONS
    far = [int((points[:, :2] @ way).argmax())
           for way in np.column_stack([np.cos(turns), np.sin(turns)])]
    return points[sorted({*far, int(points[:, 2].argmin()), int(points[:, 2].argmax())})]
