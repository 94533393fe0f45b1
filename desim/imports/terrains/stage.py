"""Worlds of Stage: floor plans in bitmaps, and models made of blocks.

As Stage has it (model.cc, blockgroup.cc): the blocks of a model, or the dark pixels of its bitmap,
are stretched to its ``size``; ``boundary`` puts walls along its sides; a model in another one
stands on top of it; robots and rays pass what has neither an obstacle's nor a ranger's return.
"""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import numpy as np

from desim.errors import InputError
from desim.files import content, near, opened_below
from desim.imports.terrains import stage_files
from desim.imports.terrains.found import (
    NEAREST_M,
    Choices,
    FoundTerrain,
    ImportedPlan,
    Point,
    Start,
    material_of,
)
from desim.imports.terrains.grid_drawing import Bitmap, draw
from desim.imports.terrains.stage_files import StageEntity, StageValue
from desim.world import map_images, sources
from desim.world.terrain import Terrain, of_free_cells

_LOW_M, _HIGH_M = 0.05, 1.0  # above the ground: what lies on it, up to the height of a robot
_BOUNDARY_M = 0.01
_MATERIAL = "concrete"
_DARK = 127  # the brightest grey that is solid
_MOST_MODELS, _DEEPEST = 20_000, 20
_MOST_BYTES = 10_000_000
_NO_BODIES = {
    "window", "block", "ranger", "sensor", "laser", "camera", "fiducial", "fiducialfinder",
    "blobfinder", "gripper", "sonar", "bumper", "wifi", "actuator", "blinkenlight",
    "lightindicator", "speech", "loadcell", "gps"}


class _Size(NamedTuple):
    """Of a model."""

    width_m: float
    depth_m: float
    high_m: float


_SIZE_M = _Size(0.4, 0.4, 1.0)  # of a model that says nothing


class _Pose(NamedTuple):
    """A place in the world: the height is that of the ground that a model stands on."""

    x_m: float = 0.0
    y_m: float = 0.0
    z_m: float = 0.0
    yaw_rad: float = 0.0

    def then(self, other: _Pose) -> _Pose:
        x_m, y_m = self.point(other.x_m, other.y_m)
        return _Pose(x_m, y_m, self.z_m + other.z_m, self.yaw_rad + other.yaw_rad)

    def point(self, x_m: float, y_m: float) -> Point:
        cos, sin = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return self.x_m + cos * x_m - sin * y_m, self.y_m + sin * x_m + cos * y_m


def read(path: Path, choices: Choices) -> FoundTerrain:
    """The terrain of a world. Raises ``InputError``."""
    world = stage_files.read(path, content(path, _MOST_BYTES))
    reading = _Reading(path, choices, world.top)
    for entity in world.top.children:
        reading.place(entity, _Pose(), 1)
    return reading.found(world.missing)


class _Reading:
    """The blocks, bitmaps and robots so far."""

    def __init__(self, path: Path, choices: Choices, top: StageEntity) -> None:
        self._path, self._choices = path, choices
        self._bitmaps: list[Bitmap] = []
        self._shapes: list[tuple[np.ndarray, float]] = []  # corners [n, 2] m, and the height
        self._starts: list[Start] = []
        self._left_out: Counter[str] = Counter()
        self._models, self._high_m = 0, 0.0
        self._unit_m, = _numbers(top, "unit_length", 1, text=("m",)) or (1.0,)
        angle = top.values.get("unit_angle")
        self._angle = 1.0 if angle and angle.words == ("radians",) else math.radians(1.0)

    def place(self, entity: StageEntity, below: _Pose, depth: int) -> None:
        """Add an entity that stands at ``below``, and what stands on it."""
        if entity.type in _NO_BODIES:
            return
        self._models += 1
        if self._models > _MOST_MODELS or depth > _DEEPEST:
            raise InputError(f"{entity.where}: more than {_MOST_MODELS} models, or more than "
                             f"{_DEEPEST} on each other")
        at = below.then(self._pose(entity, "pose"))
        if entity.type == "position":
            self._starts.append(Start(at.x_m, at.y_m, at.yaw_rad))
        elif entity.type != "model":
            self._left_out[f"{entity.type} (unknown)"] += 1
        else:
            given = _numbers(entity, "size", 3, least=2) or ()
            size = _Size(*(self._unit_m * value for value in given), *_SIZE_M[len(given):])
            if min(size) < 0.0 or min(size[:2]) == 0.0:
                raise InputError(f"{entity.where}: size must be above zero, got {given}")
            if self._is_met(entity, at, size):
                self._body(entity, at.then(self._pose(entity, "origin")), size)
            for child in entity.children:
                self.place(child, at._replace(z_m=at.z_m + size.high_m), depth + 1)

    def _pose(self, entity: StageEntity, key: str) -> _Pose:
        """x, y, z and the angle; of three numbers the last is the angle."""
        given = _numbers(entity, key, 4, least=3)
        if given is None:
            return _Pose()
        *place, angle = given
        x_m, y_m, z_m = (self._unit_m * value for value in (*place, 0.0)[:3])
        return _Pose(x_m, y_m, z_m, self._angle * angle)

    def _is_met(self, entity: StageEntity, at: _Pose, size: _Size) -> bool:
        """Whether a robot at this height can meet a model or sense it."""
        obstacle, = _numbers(entity, "obstacle_return", 1) or (1.0,)
        ranger, = _numbers(entity, "ranger_return", 1) or (1.0,)
        reason = ("passed by robots and rays" if obstacle == 0.0 and ranger < 0.0 else
                  "flat on the ground" if at.z_m + size.high_m <= _LOW_M else
                  "overhead" if at.z_m >= _HIGH_M else "")
        if reason:
            self._left_out[reason] += 1
        return not reason

    def _body(self, entity: StageEntity, at: _Pose, size: _Size) -> None:
        """Add the blocks of a model, its bitmap and its boundary."""
        top_m = at.z_m + size.high_m
        bitmap = entity.values.get("bitmap")
        outlines = [_outline(block) for block in entity.children if block.type == "block"]
        if bitmap and bitmap.words not in ((), ("",)):
            solid = self._dark(bitmap)
            self._bitmaps.append(Bitmap(solid, size[:2], at.x_m, at.y_m, at.yaw_rad))
            self._high_m = max(self._high_m, top_m)
        elif not outlines:
            outlines = [np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])]
        if outlines:
            corners = np.concatenate(outlines)
            low, extent = corners.min(axis=0), np.maximum(np.ptp(corners, axis=0), 1e-9)
            for outline in outlines:
                self._shape(((outline - low) / extent - 0.5) * size[:2], at, top_m)
        boundary, = _numbers(entity, "boundary", 1) or (0.0,)
        if boundary != 0.0:
            (x, y), thick = np.array(size[:2]) / 2, _BOUNDARY_M
            for x0, y0, x1, y1 in ((-x, -y, x, thick - y), (-x, y - thick, x, y),
                                   (-x, -y, thick - x, y), (x - thick, -y, x, y)):
                self._shape(np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)]), at, top_m)

    def _shape(self, corners: np.ndarray, at: _Pose, top_m: float) -> None:
        self._shapes.append((np.array([at.point(x, y) for x, y in corners.tolist()]), top_m))

    def _dark(self, bitmap: StageValue) -> np.ndarray:
        """[rows, cols] bool, row 0 lowest: the dark pixels of an image, cut to the box around
        them."""
        name, folder = bitmap.words[0], self._path.absolute().parent
        try:
            with map_images.opened(folder / name, opened_below(
                    *near(folder, name), map_images.MOST_BYTES)) as image:
                _, cells, values = map_images.greys(folder / name, image)
        except FileNotFoundError:
            raise InputError(f"{bitmap.where}: bitmap: no file {name!r} in the world's folder, "
                             "and in the one above"
                             ) from None
        dark = (values <= _DARK)[cells][::-1]
        rows, cols = np.flatnonzero(dark.any(axis=1)), np.flatnonzero(dark.any(axis=0))
        if not len(rows):
            raise InputError(f"{bitmap.where}: bitmap {name!r} has no dark pixel")
        return dark[rows[0]:rows[-1] + 1, cols[0]:cols[-1] + 1]

    def found(self, missing: list[str]) -> FoundTerrain:
        """All of it: cells if there are bitmaps, else walls and blocks."""
        notes = self._notes(missing)
        if self._bitmaps:
            shape, terrain = None, self._in_cells(notes)
        else:
            plan = ImportedPlan()
            plan.notes += notes
            for corners, top_m in self._shapes:
                plan.block(map(tuple, corners.tolist()), self._choices.height_m or top_m,
                           self._choices.material or _MATERIAL)
            shape = plan.shape(self._path)
            terrain = sources.from_shape(self._path.stem, shape)
        starts = self._clear_starts(terrain, notes)
        return FoundTerrain(terrain, shape, notes=tuple(notes), starts=starts)

    def _in_cells(self, notes: list[str]) -> Terrain:
        cell_m = self._choices.resolution_m or min(bitmap.pixel_m for bitmap in self._bitmaps)
        ground = draw(self._bitmaps, [corners for corners, _ in self._shapes], cell_m)
        if not ground.free.any():
            raise InputError(f"{self._path}: no free ground between its bitmaps")
        height_m = self._choices.height_m or self._high_m
        notes.append(f"cells of {cell_m:.3g} m (--resolution), all {height_m:g} m high (--height)")
        return of_free_cells(self._path, ground.free, material_of(self._choices, _MATERIAL),
                             cell_m, ground.corner_m, height_m)

    def _clear_starts(self, terrain: Terrain, notes: list[str]) -> tuple[Start, ...]:
        """The starts of robots that are not too near to a wall."""
        if not self._starts:
            return ()
        clear = terrain.clearance(np.array(self._starts)[:, :2], NEAREST_M) >= NEAREST_M - 1e-9
        kept = tuple(start for start, is_clear in zip(self._starts, clear, strict=True) if is_clear)
        first = ", ".join(f"({x:.3g}, {y:.3g})" for x, y, _ in self._starts[:5])
        notes.append(f"robots: {len(self._starts)}, which are the fleet of a scenario (--to): "
                     f"{first}{', ...' if len(self._starts) > 5 else ''}")
        if len(kept) < len(self._starts):
            notes.append(f"of these {len(self._starts) - len(kept)} are less than {NEAREST_M:g} m "
                         "from a wall, and left out")
        return kept

    def _notes(self, missing: list[str]) -> list[str]:
        notes = []
        if missing:
            notes.append(f"left out, as they cannot be read: {', '.join(missing)}")
        if self._left_out:
            notes.append("left out: " + ", ".join(
                f"{what} ({count})" for what, count in sorted(self._left_out.items())))
        if self._choices.material is None:
            notes.append(f"all counts as {_MATERIAL} (--material)")
        return notes


def _outline(block: StageEntity) -> np.ndarray:
    """[n, 2] the corners of a block, in its own units."""
    count, = _numbers(block, "points", 1) or (0.0,)
    points = [_numbers(block, f"point[{number}]", 2) for number in range(int(min(count, 10_000)))]
    if len(points) < 3 or None in points:
        raise InputError(f"{block.where}: block: points must say how many corners there are, at "
                         "least 3, and point[0] and so on where they are")
    return np.array(points)


def _numbers(entity: StageEntity, key: str, count: int, *, least: int | None = None,
             text: tuple[str, ...] = ()) -> tuple[float, ...] | None:
    """The numbers of a property, None if it is not given, or given as ``text``. Raises
    ``InputError`` unless there are ``count`` finite ones, or ``least``."""
    given = entity.values.get(key)
    if given is None or given.words == text:
        return None
    try:
        found = tuple(map(float, given.words))
    except ValueError:
        found = ()
    if not (least or count) <= len(found) <= count or not all(map(math.isfinite, found)):
        raise InputError(f"{given.where}: {key}: must be {f'{least} or ' if least else ''}{count} "
                         f"number{'s' if count > 1 else ''}, got {' '.join(given.words)[:80]!r}")
    return found
