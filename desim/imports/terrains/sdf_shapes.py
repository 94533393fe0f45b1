"""Convex shapes of SDF, as points whose hull they are."""

from __future__ import annotations

from itertools import product

import numpy as np

from desim.errors import InputError
from desim.imports.terrains.sdf_frames import numbers
from desim.outside_xml import Element

_CORNERS = 24  # of a circle: at most 0.9 % of its radius from it
_RINGS = 7  # of a sphere, and its poles


def corners_of(shape: Element, file: str) -> np.ndarray | None:
    """[n, 3] m points of a shape around its centre; None for one that is not known. Raises
    ``InputError`` for a size that is none."""
    def size(key: str, count: int = 1) -> tuple[float, ...]:
        found = numbers(shape, key, count, file)
        if found is None or min(found) < 0.0:
            raise InputError(f"{file}:{shape.line}: {shape.tag}: {key} must be given, and not be "
                             "below zero")
        return found

    if shape.tag == "box":
        return np.array(list(product((-0.5, 0.5), repeat=3))) * size("size", 3)
    if shape.tag == "cylinder":
        (radius,), (length,) = size("radius"), size("length")
        return np.concatenate([_ring(radius, -length / 2), _ring(radius, length / 2)])
    if shape.tag == "cone":
        (radius,), (length,) = size("radius"), size("length")
        return np.concatenate([_ring(radius, -length / 2), [(0.0, 0.0, length / 2)]])
    if shape.tag == "sphere":
        return _sphere() * size("radius")
    if shape.tag == "ellipsoid":
        return _sphere() * size("radii", 3)
    if shape.tag == "capsule":
        ball, up = _sphere() * size("radius"), (0.0, 0.0, size("length")[0] / 2)
        return np.concatenate([ball - up, ball + up])
    return None


def _ring(radius_m: float, z_m: float) -> np.ndarray:
    angles = np.arange(_CORNERS) * (2.0 * np.pi / _CORNERS)
    return np.column_stack([radius_m * np.cos(angles), radius_m * np.sin(angles),
                            np.full(_CORNERS, z_m)])


def _sphere() -> np.ndarray:
    """Of radius 1."""
    heights = np.linspace(-np.pi / 2, np.pi / 2, _RINGS + 2)[1:-1]
    return np.concatenate([*(_ring(np.cos(angle), np.sin(angle)) for angle in heights),
                           [(0.0, 0.0, -1.0), (0.0, 0.0, 1.0)]])
