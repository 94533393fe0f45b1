"""Poses of SDF's elements, and the frames that they are relative to."""

from __future__ import annotations

import math

import numpy as np

from desim.errors import InputError, did_you_mean
from desim.imports.terrains.meshes import around
from desim.outside_xml import Element

_FRAMED = ("link", "model", "frame", "joint", "include")
_SCOPE = ("", "world", "__model__", "__root__")  # names of the frame that they are in
_LONGEST = 20  # frames relative to each other


class SdfFrames:
    """The named frames of a world or a model."""

    def __init__(self, scope: Element, file: str) -> None:
        self._file = file
        self._named = {_name(child): child for child in scope.all(*_FRAMED)}
        state = scope.first("state")
        self._saved = {child.attributes.get("name"): child
                       for child in (state.all("model") if state else ()) if child.first("pose")}

    def pose(self, element: Element, longest: int = _LONGEST) -> np.ndarray:
        """[4, 4] an element's pose in the scope. Raises ``InputError``."""
        if element.tag == "model" and (saved := self._saved.get(element.attributes.get("name"))):
            return pose_of(saved, self._file)
        pose = element.first("pose")
        base = (pose.attributes.get("relative_to") or pose.attributes.get("frame")
                if pose else None) or element.attributes.get("attached_to")
        if base is None and element.tag == "joint" and (child := element.first("child")):
            base = child.text.strip()
        own = pose_of(element, self._file)
        if base is None or base in _SCOPE:
            return own
        where = f"{self._file}:{(pose or element).line}: pose"
        if longest == 0:
            raise InputError(f"{where}: more than {_LONGEST} frames are relative to each other")
        return self._frame(base, where, longest) @ own

    def _frame(self, base: str, where: str, longest: int) -> np.ndarray:
        name, _, inner = (base, "", "") if base in self._named else base.partition("::")
        if name not in self._named:
            raise InputError(f"{where}: no frame {base!r} here{did_you_mean(base, self._named)}; "
                             f"allowed: {', '.join(self._named)}")
        outer = self._named[name]
        at = self.pose(outer, longest - 1)
        return at @ SdfFrames(outer, self._file)._frame(inner, where, longest) if inner else at


def pose_of(element: Element, file: str) -> np.ndarray:
    """[4, 4] an element's own pose: x y z in m, and roll pitch yaw, or a quaternion x y z w.
    Raises ``InputError``."""
    pose, at = element.first("pose"), np.eye(4)
    if pose is None or not pose.text.strip():
        return at
    if pose.attributes.get("rotation_format") == "quat_xyzw":
        x, y, z, *axis, w = numbers(pose, None, 7, file) or ()
        size = math.hypot(*axis, w) or 1.0
        at[:3, :3] = around(np.array(axis), 2.0 * math.acos(max(-1.0, min(1.0, w / size))))
    else:
        x, y, z, *turns = numbers(pose, None, 6, file) or ()
        if pose.attributes.get("degrees") in ("true", "1"):
            turns = [math.radians(turn) for turn in turns]
        for axis_of, turn in zip(np.eye(3), turns, strict=True):
            at[:3, :3] = around(axis_of, turn) @ at[:3, :3]
    at[:3, 3] = x, y, z
    return at


def numbers(element: Element, key: str | None, count: int, file: str) -> tuple[float, ...] | None:
    """The numbers in a child, or in the element itself; None where there is no such child. Raises
    ``InputError`` unless there are ``count`` finite ones."""
    given = element if key is None else element.first(key)
    if given is None:
        return None
    try:
        found = tuple(float(word) for word in given.text.split())
    except ValueError:
        found = ()
    if len(found) != count or not all(map(math.isfinite, found)):
        raise InputError(f"{file}:{given.line}: {given.tag}: must be {count} number"
                         f"{'s' if count > 1 else ''}, got {given.text.strip()[:80]!r}")
    return found


def is_static(element: Element) -> bool:
    """Whether a model or an include says that it cannot be moved."""
    given = element.first("static")
    return given is not None and given.text.strip().lower() in ("1", "true")


def _name(element: Element) -> str:
    given = element.first("name")
    return element.attributes.get("name") or (given.text.strip() if given else "")
