"""Descriptions of robots (URDF): the outline and height of the body, and its lasers with mounts.

Joints stand at zero, as robot_state_publisher has them without joint states. The ground is the
height of ``base_footprint``, or the lowest point of the body.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from desim import outside_xml
from desim.errors import InputError
from desim.files import content
from desim.imports.robots import mesh_files
from desim.imports.robots.found import FoundRobot, disc_m, hull
from desim.outside_xml import Element
from desim.scenario.source_places import SourcePlace
from desim.units import ANGLE, FREQUENCY, LENGTH, POSITION

_MOST_BYTES, _CIRCLE = 20_000_000, 32  # corners that stand for a circle
_COMMENT = re.compile(rb"<!--.*?-->", re.DOTALL)
_XACRO = re.compile(rb"<xacro:(?!arg\b|property\b)(\w+)")
_NAMESPACE = "${namespace}"  # before names of links, in files that may stay as they are
_SENSORS = ("ray", "gpu_ray", "lidar", "gpu_lidar")
_LEVEL = math.cos(math.radians(5.0))  # a laser's plane that is tilted by less counts as level


def read(path: Path, found: FoundRobot) -> None:
    """Add what a description says. Raises ``InputError``."""
    text = content(path, _MOST_BYTES)
    if used := _XACRO.search(_COMMENT.sub(b"", text)):
        raise InputError(f"{path}: has xacro:{used[1].decode()}, which desim does not expand; make "
                         f"a URDF of it with: xacro {path.name} > robot.urdf")
    _Description(path, outside_xml.parse(path, text), found).take()


class _Description:
    """A description, whose links have poses with respect to the base."""

    def __init__(self, path: Path, root: Element, found: FoundRobot) -> None:
        self._path, self._root, self._found = path, root, found
        self._links = {self._name(link): link for link in root.all("link")}
        self._poses = self._placed()
        self._collides = any(any(link.all("collision")) for link in self._links.values())

    def take(self) -> None:
        seen = [name for name in self._poses if any(self._links[name].all("visual"))
                and not any(self._links[name].all("collision"))]
        if self._collides and seen:
            self._found.notes.append(f"{self._path}: links without a collision are no part of the "
                                     f"body: {', '.join(seen)}")
        corners, missing = [], []
        for name, pose in self._poses.items():
            for shape, at in self._shapes(self._links[name]):
                try:
                    corners.append(mesh_files.outermost(
                        self._corners(shape) @ (pose @ at)[:3, :3].T + (pose @ at)[:3, 3]))
                except (OSError, ValueError):
                    missing.append(name)
        if missing:
            self._found.notes.append(f"{self._path}: without the meshes that cannot be read, of: "
                                     f"{', '.join(dict.fromkeys(missing))}")
        every = np.concatenate(corners) if corners else np.zeros((0, 3))
        ground_m = (float(self._poses["base_footprint"][2, 3]) if "base_footprint" in self._poses
                    else float(every[:, 2].min()) if len(every) else 0.0)
        if len(every):
            self._body(every, ground_m)
        self._lasers(ground_m)

    def _body(self, corners: np.ndarray, ground_m: float) -> None:
        place = self._place(self._root)
        outline = hull([(round(float(x), 3), round(float(y), 3)) for x, y, _ in corners])
        radius_m = disc_m(outline)
        if radius_m is not None:
            self._found.put(("radius",), LENGTH.format(radius_m), place)
        elif len(outline) > 2:
            self._found.put(("footprint",), [[POSITION.format(x), POSITION.format(y)]
                                             for x, y in outline], place)
        height_m = round(float(corners[:, 2].max()) - ground_m, 3)
        if height_m > 0.0:
            self._found.put(("height",), LENGTH.format(height_m), place)

    def _shapes(self, link: Element) -> Iterator[tuple[Element, np.ndarray]]:
        """The shapes of a link with their poses: those of collisions, where the robot has any."""
        for part in link.all("collision" if self._collides else "visual"):
            geometry = part.first("geometry")
            for shape in geometry.children if geometry else ():
                if shape.tag in ("box", "cylinder", "capsule", "sphere", "mesh"):
                    yield shape, self._origin(part)

    def _corners(self, shape: Element) -> np.ndarray:
        """Points around a shape. Raises ``OSError`` and ``ValueError`` for a mesh."""
        if shape.tag == "mesh":
            corners = mesh_files.corners(self._path, shape.attributes.get("filename", ""))
            return corners * (self._numbers(shape, "scale", 3) if "scale" in shape.attributes
                              else 1.0)
        if shape.tag == "box":
            half = 0.5 * np.array(self._numbers(shape, "size", 3))
            return np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
        radius_m = self._numbers(shape, "radius", 1)[0]
        turns = np.arange(_CIRCLE) * 2.0 * math.pi / _CIRCLE
        ring = radius_m * np.column_stack([np.cos(turns), np.sin(turns), np.zeros(_CIRCLE)])
        if shape.tag == "sphere":
            return np.concatenate([ring, [(0.0, 0.0, radius_m), (0.0, 0.0, -radius_m)]])
        up = np.array([0.0, 0.0, 0.5 * self._numbers(shape, "length", 1)[0]])
        return np.concatenate([ring + up, ring - up])

    def _lasers(self, ground_m: float) -> None:
        lasers: dict[str, tuple[dict[str, object], Element]] = {}
        others: list[str] = []
        for part in self._root.all("gazebo"):
            link = part.attributes.get("reference", "").replace(_NAMESPACE, "")
            for sensor in part.all("sensor"):
                if sensor.attributes.get("type") in _SENSORS and link in self._poses:
                    name = _word(sensor.attributes.get("name", link))
                    name = _word(f"{link}_{name}") if name in lasers else name
                    lasers[name] = self._laser(sensor, self._poses[link], ground_m), sensor
                else:
                    others.append(f"{sensor.attributes.get('name', link)} "
                                  f"({sensor.attributes.get('type', 'of no type')})")
        if others:
            self._found.notes.append(f"{self._path}: sensors left out: {', '.join(others)}")
        if not lasers and (mounts := self._mounts()):
            lasers = {_word(name): (self._mount(self._poses[name], ground_m, 0.0, link), link)
                      for name, link in mounts.items()}
            self._found.notes.append(f"{self._path}: no sensor of Gazebo; lasers stand where these "
                                     f"links are, with desim's default beams: {', '.join(mounts)}")
        for name, (laser, element) in lasers.items():
            path = ("robot", "laser") if len(lasers) == 1 else ("robot", "lasers", name)
            self._found.put(path, laser, self._place(element))

    def _mounts(self) -> dict[str, Element]:
        """The links that are called as lasers are, without those that only carry another one."""
        named = {name: self._links[name] for name in self._poses
                 if re.search("scan|laser|lidar", name.lower())}
        for joint in self._root.all("joint"):
            carrier, carried = (end.attributes.get("link", "").replace(_NAMESPACE, "") if end
                                else "" for end in (joint.first("parent"), joint.first("child")))
            if carried in named:
                named.pop(carrier, None)
        return named

    def _laser(self, sensor: Element, pose: np.ndarray, ground_m: float) -> dict[str, object]:
        ray = next(filter(None, map(sensor.first, _SENSORS)), Element("ray", {}, sensor.line))
        samples = self._within(ray, "scan", "horizontal", "samples")
        low = self._within(ray, "scan", "horizontal", "min_angle")
        high = self._within(ray, "scan", "horizontal", "max_angle")
        farthest_m = self._within(ray, "range", "max")
        rate_hz = self._within(sensor, "update_rate")
        if samples is None or low is None or high is None or farthest_m is None:
            raise InputError(f"{self._path}:{sensor.line}: a laser needs samples, min_angle and "
                             "max_angle of scan.horizontal, and range.max")
        if samples < 2 or not low < high:
            raise InputError(f"{self._path}:{sensor.line}: a laser has at least 2 samples, from a "
                             f"lower to a higher angle, got {samples:g}, {low:g} to {high:g}")
        vertical = self._within(ray, "scan", "vertical", "samples")
        if vertical is not None and vertical > 1:
            self._found.notes.append(f"{self._path}:{sensor.line}: one plane of {vertical:g}")
        written = sensor.first("pose")
        if written is not None:
            pose = pose @ _pose(*self._six(written, written.text))
        view_rad = min(high - low, 2.0 * math.pi)
        laser = {"beams": int(samples), "field_of_view": ANGLE.format(view_rad),
                 "max_range": LENGTH.format(farthest_m),
                 **self._mount(pose, ground_m, 0.5 * (low + high), sensor)}
        noise_m = self._within(ray, "noise", "stddev")
        if noise_m:
            laser["noise"] = LENGTH.format(noise_m)
        if rate_hz:
            laser["rate"] = FREQUENCY.format(rate_hz)
        return laser

    def _mount(self, pose: np.ndarray, ground_m: float, middle_rad: float, of: Element,
               ) -> dict[str, object]:
        if abs(pose[2, 2]) < _LEVEL:
            tilt_deg = math.degrees(math.acos(abs(pose[2, 2])))
            self._found.notes.append(f"{self._path}:{of.line}: this laser is tilted by "
                                     f"{tilt_deg:.0f} degrees; here its plane is level")
        ahead = pose[:3, :3] @ (math.cos(middle_rad), math.sin(middle_rad), 0.0)
        x_m, y_m, yaw_rad = (round(float(value), 4) + 0.0 for value in (
            pose[0, 3], pose[1, 3], math.atan2(ahead[1], ahead[0])))
        return {"height": LENGTH.format(max(0.0, round(float(pose[2, 3]) - ground_m, 4))),
                "x": POSITION.format(x_m), "y": POSITION.format(y_m),
                "yaw": ANGLE.format(yaw_rad)}

    def _placed(self) -> dict[str, np.ndarray]:
        """The poses of all links that hang together, with respect to the base."""
        below: dict[str, list[tuple[str, np.ndarray]]] = {}
        children = set()
        for joint in self._root.all("joint"):
            ends = [end.attributes.get("link", "").replace(_NAMESPACE, "") if end else ""
                    for end in (joint.first("parent"), joint.first("child"))]
            for end in ends:
                if end not in self._links:
                    raise InputError(f"{self._path}:{joint.line}: joint {self._name(joint)}: there "
                                     f"is no link {end!r}")
            if ends[1] in children:
                raise InputError(f"{self._path}:{joint.line}: link {ends[1]!r} hangs on two joints")
            children.add(ends[1])
            below.setdefault(ends[0], []).append((ends[1], self._origin(joint)))
        roots = [name for name in self._links if name not in children]
        if len(roots) != 1:
            raise InputError(f"{self._path}: must have one link that is no joint's child, has "
                             f"{', '.join(roots) or 'none'}")
        poses = {roots[0]: np.eye(4)}
        waiting = [roots[0]]
        while waiting:
            name = waiting.pop()
            for child, origin in below.get(name, ()):
                poses[child] = poses[name] @ origin
                waiting.append(child)
        if loose := [name for name in self._links if name not in poses]:
            raise InputError(f"{self._path}: joints in a circle, between {', '.join(loose)}")
        base = next((poses[name] for name in ("base_footprint", "base_link") if name in poses),
                    poses[roots[0]])
        return {name: np.linalg.inv(base) @ pose for name, pose in poses.items()}

    def _name(self, element: Element) -> str:
        return element.attributes.get("name", "").replace(_NAMESPACE, "")

    def _origin(self, element: Element) -> np.ndarray:
        origin = element.first("origin")
        if origin is None:
            return np.eye(4)
        return _pose(*self._six(origin, f"{origin.attributes.get('xyz', '0 0 0')} "
                                        f"{origin.attributes.get('rpy', '0 0 0')}"))

    def _six(self, element: Element, text: str) -> list[float]:
        return self._floats(element, text, 6)

    def _numbers(self, element: Element, name: str, count: int) -> list[float]:
        return self._floats(element, element.attributes.get(name, ""), count)

    def _floats(self, element: Element, text: str, count: int) -> list[float]:
        if "${" in text or "$(" in text:
            raise InputError(f"{self._path}:{element.line}: {text.strip()!r} is for xacro, which "
                             f"desim does not expand; make a URDF of it with: xacro "
                             f"{self._path.name} > robot.urdf")
        try:
            numbers = [float(word) for word in text.split()]
        except ValueError:
            numbers = []
        if len(numbers) != count or not all(map(math.isfinite, numbers)):
            raise InputError(f"{self._path}:{element.line}: {element.tag}: must have {count} "
                             f"number{'s' * (count > 1)}, got {text.strip()!r}")
        return numbers

    def _within(self, element: Element, *tags: str) -> float | None:
        """The number in the element that these tags lead to, if there is one."""
        here: Element | None = element
        for tag in tags:
            here = here.first(tag) if here else None
        return None if here is None else self._floats(here, here.text, 1)[0]

    def _place(self, element: Element) -> SourcePlace:
        return SourcePlace(str(self._path), element.line, 1)


def _word(text: str) -> str:
    return re.sub(r"\W", "_", text) or "laser"


def _pose(x: float, y: float, z: float, roll: float, pitch: float, yaw: float) -> np.ndarray:
    """The homogeneous matrix of a pose: fixed axes, roll, then pitch, then yaw (REP 103)."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(angle), math.sin(angle))
                                    for angle in (roll, pitch, yaw))
    return np.array([[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, x],
                     [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, y],
                     [-sp, cp * sr, cp * cr, z],
                     [0.0, 0.0, 0.0, 1.0]])
