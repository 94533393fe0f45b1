"""Worlds of Gazebo, Classic and new (SDF): the collisions of models, where robots meet them.

The elements and their frames are those of sdformat.org's specification; ``include``'s pose takes
the place of its model's, and a pose that Gazebo Classic saved in ``state`` that of the world's.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np

from desim import outside_xml
from desim.errors import InputError
from desim.imports.terrains import meshes, slices
from desim.imports.terrains.found import Choices, ImportedPlan
from desim.imports.terrains.model_files import ModelFiles, ModelFolder
from desim.imports.terrains.sdf_frames import SdfFrames, is_static, numbers, pose_of
from desim.imports.terrains.sdf_shapes import corners_of
from desim.imports.terrains.slices import Footprint, Slab
from desim.outside_xml import Element

_SLAB = Slab(0.05, 1.0)  # m above the ground: what lies on it, up to the height of a robot
_CELL_M = 0.05
_DEEPEST = 20  # models in models
_MOST_MODELS = 20_000
_NO_MATTER = ("sun", "ground_plane")  # models of Gazebo's own
# In the names of plug-ins that move a robot.
_DRIVES = ("drive", "planar_move", "planarmove", "skid_steer", "control", "ackermann", "mecanum",
           "drone", "copter", "rotor")
_CLASSIC = (1, 7)  # the newest SDF of Gazebo Classic; the new Gazebo does not restore a state


def read(path: Path, choices: Choices) -> ImportedPlan:
    """The plan of a world, or of a model alone. Raises ``InputError``."""
    root = outside_xml.read(path)
    world = root if root.tag == "world" else root.first("world") or root
    if world is root and not any(root.all("model", "include")):
        raise InputError(f"{path}: no <world> and no <model> in <{root.tag}>")
    reading = _Reading(path, choices)
    if _version(root) > _CLASSIC:
        world.children = [child for child in world.children if child.tag != "state"]
    reading.scope(world, _Source(str(path), reading.files.here), np.eye(4), False, 0)
    reading.take_notes(len(list(root.all("world"))))
    return reading.plan


class _Source:
    """The file that an element comes from, and the folder that it is in."""

    def __init__(self, file: str, place: ModelFolder) -> None:
        self.file, self.place = file, place


class _Reading:
    """The plan so far, and counts of what is taken for granted or left out."""

    def __init__(self, path: Path, choices: Choices) -> None:
        self.files, self.plan = ModelFiles(path), ImportedPlan()
        self._choices = choices
        self._models = 0
        self._left_out: Counter[str] = Counter()
        self._missing: Counter[str] = Counter()
        self._robots: list[str] = []
        self._movable = 0
        self._triangles: dict[tuple[ModelFolder, str], np.ndarray] = {}

    def scope(self, element: Element, source: _Source, at: np.ndarray, static: bool, deep: int,
              ) -> None:
        """All of a world or of a model, whose frame lies ``at`` [4, 4] in the world."""
        frames, can_move = SdfFrames(element, source.file), False
        for child in element.children:
            if child.tag == "model":
                self._model(child, source, at @ frames.pose(child), static, deep + 1)
            elif child.tag == "include":
                self._include(child, source, at, frames, static, deep + 1)
            elif child.tag == "link":
                before = self._size()
                self._link(child, source, at @ frames.pose(child))
                can_move |= not static and self._size() > before
            elif child.tag in ("actor", "population"):
                self._left_out[f"<{child.tag}>"] += 1
        self._movable += can_move

    def _size(self) -> int:
        return len(self.plan.polygons) + len(self.plan.walls)

    def _include(self, element: Element, source: _Source, at: np.ndarray, frames: SdfFrames,
                 static: bool, deep: int) -> None:
        given = element.first("uri")
        uri = given.text.strip() if given else ""
        if uri.rpartition("/")[2].lower().replace(" ", "_") in _NO_MATTER:
            return
        try:
            place, file, root = self.files.model(uri, source.place)
        except (OSError, ValueError):
            self._missing[uri or "an <include> without <uri>"] += 1
            return
        model = root if root.tag == "model" else root.first("model")
        if model is None:
            if root.first("light") is None:
                self._missing[uri] += 1
            return
        own = element if element.first("pose") else model
        pose = frames.pose(element) if own is element else pose_of(model, file)
        self._model(model, _Source(file, place), at @ pose, static or is_static(element), deep)

    def _model(self, element: Element, source: _Source, at: np.ndarray, static: bool, deep: int,
               ) -> None:
        self._models += 1
        if deep > _DEEPEST or self._models > _MOST_MODELS:
            raise InputError(f"{source.file}:{element.line}: more than {_MOST_MODELS} models, or "
                             f"more than {_DEEPEST} in each other")
        static = static or is_static(element)
        if not static and _drives(element):
            x_m, y_m = at[:2, 3]
            self._robots.append(f"{element.attributes.get('name', 'a model')} "
                                f"({x_m:.3g}, {y_m:.3g})")
            return
        self.scope(element, source, at, static, deep)

    def _link(self, element: Element, source: _Source, at: np.ndarray) -> None:
        collisions = list(element.all("collision"))
        if not collisions and element.first("visual"):
            self._left_out["link without <collision>"] += 1
        for collision in collisions:
            geometry = collision.first("geometry")
            placed = at @ pose_of(collision, source.file)
            for shape in geometry.children if geometry else ():
                self._shape(shape, source, placed)

    def _shape(self, shape: Element, source: _Source, at: np.ndarray) -> None:
        if shape.tag == "mesh":
            self._mesh(shape, source, at)
        elif shape.tag == "polyline":
            self._polyline(shape, source, at)
        elif shape.tag in ("plane", "empty"):
            if shape.tag == "plane":
                self._plane(shape, source, at)
        elif (corners := corners_of(shape, source.file)) is not None:
            corners = corners @ at[:3, :3].T + at[:3, 3]
            self._add([slices.of_convex(corners, _SLAB)], corners)
        else:
            self._left_out[f"<{shape.tag}>"] += 1

    def _add(self, found: list[Footprint | None], corners: np.ndarray) -> None:
        """Add footprints of a shape with these ``corners`` [n, 3]."""
        if not np.ptp(corners, axis=0).any():
            self._left_out["shape without size"] += 1
        elif corners[:, 2].max() <= _SLAB.low_m:
            self._left_out["shape on or below the ground"] += 1
        elif corners[:, 2].min() >= _SLAB.high_m:
            self._left_out["shape overhead"] += 1
        else:
            for footprint in found:
                if footprint is not None:
                    self.plan.block(map(tuple, footprint.corners.tolist()),
                                    self._choices.height_m or footprint.top_m,
                                    self._choices.material or "concrete")

    def _plane(self, shape: Element, source: _Source, at: np.ndarray) -> None:
        normal = at[:3, :3] @ (numbers(shape, "normal", 3, source.file) or (0.0, 0.0, 1.0))
        if abs(normal[2]) < 0.999 * float(np.linalg.norm(normal)):
            self._left_out["plane that is not level"] += 1

    def _polyline(self, shape: Element, source: _Source, at: np.ndarray) -> None:
        flat = [[float(value) for value in numbers(point, None, 2, source.file) or ()]
                for point in shape.all("point")]
        height_m, = numbers(shape, "height", 1, source.file) or (1.0,)
        if len(flat) < 3 or abs(at[2, 2]) < 0.999:
            self._left_out["polyline that does not stand upright"] += 1
            return
        ends = [np.column_stack([flat, np.full(len(flat), z)]) @ at[:3, :3].T + at[:3, 3]
                for z in (0.0, height_m)]
        corners = np.concatenate(ends)
        self._add([Footprint(ends[0][:, :2], float(corners[:, 2].max()))], corners)

    def _mesh(self, shape: Element, source: _Source, at: np.ndarray) -> None:
        given = shape.first("uri")
        uri = given.text.strip() if given else ""
        try:
            place, name, content = self.files.content(uri, source.place)
            if (place, name) not in self._triangles:
                self._triangles[place, name] = meshes.triangles(name, content)
        except (OSError, ValueError, InputError):
            self._missing[uri or "a <mesh> without <uri>"] += 1
            return
        scale = np.array(numbers(shape, "scale", 3, source.file) or (1.0, 1.0, 1.0))
        corners = self._triangles[place, name] * scale @ at[:3, :3].T + at[:3, 3]
        self._add(list(slices.of_mesh(corners, _SLAB, self._choices.resolution_m or _CELL_M)),
                  corners.reshape(-1, 3))

    def take_notes(self, worlds: int) -> None:
        """Write down what was taken for granted and left out."""
        notes = self.plan.notes
        notes.append(f"what lies between {_SLAB.low_m:g} m and {_SLAB.high_m:g} m above z = 0 "
                     "counts as solid")
        if worlds > 1:
            notes.append(f"the first of {worlds} worlds")
        if self._missing:
            names = ", ".join(f"{uri} ({count})" if count > 1 else uri
                              for uri, count in self._missing.most_common(10))
            more = "" if len(self._missing) <= 10 else f", and {len(self._missing) - 10} others"
            notes.append(f"left out, as not found beside the file or not readable: {names}{more}")
        if self._left_out:
            notes.append("left out: " + ", ".join(
                f"{what} ({count})" for what, count in sorted(self._left_out.items())))
        if self._robots:
            notes.append(f"robots, which are no part of the terrain: {', '.join(self._robots)}")
        if self._movable:
            notes.append(f"models that could be pushed (not static) stand still: {self._movable}")
        if self._choices.material is None:
            notes.append("all counts as concrete (--material)")


def _version(root: Element) -> tuple[int, ...]:
    return tuple(int(part) for part in root.attributes.get("version", "").split(".")
                 if part.isdecimal())


def _drives(model: Element) -> bool:
    """Whether a plug-in makes a model drive."""
    return any(drive in (plugin.attributes.get("filename", "")
                         + plugin.attributes.get("name", "")).lower()
               for plugin in model.all("plugin") for drive in _DRIVES)
