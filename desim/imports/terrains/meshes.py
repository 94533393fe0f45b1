"""Triangles of meshes: STL (ASCII and binary), OBJ and COLLADA (DAE).

The unit of COLLADA is applied and its up axis is not, as Gazebo has it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from desim import outside_xml
from desim.outside_xml import Element

_MOST_TRIANGLES = 1_000_000
_DEEPEST = 50  # nodes of a scene that instantiate each other


def triangles(path: str, content: bytes) -> np.ndarray:
    """[n, 3, 3] the corners of a mesh in its own units. Raises ``ValueError`` for a format that is
    not known, and for what cannot be read."""
    form = path.rpartition(".")[2].lower()
    if form not in _FORMS:
        raise ValueError(f"a mesh in the format .{form}; allowed: .stl, .obj, .dae")
    try:
        found = _FORMS[form](path, content)
    except (IndexError, OverflowError):
        raise ValueError("the mesh has an index or a number out of bounds") from None
    if not len(found) or not np.isfinite(found).all():
        raise ValueError("the mesh has no triangle, or a corner that is no number")
    return found


def _stl(path: str, content: bytes) -> np.ndarray:
    """Binary STL has a header of 80 bytes and 50 bytes a triangle, the first 12 its normal."""
    count = int.from_bytes(content[80:84], "little") if len(content) >= 84 else -1
    if 84 + 50 * count <= len(content) and not (content[:5] == b"solid" and b"vertex" in content):
        rows = np.frombuffer(content, np.uint8, 50 * count, 84).reshape(-1, 50)
        return rows[:, 12:48].copy().view("<f4").reshape(-1, 3, 3).astype(np.float64)
    numbers = re.findall(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", content)
    if not numbers or len(numbers) % 3:
        raise ValueError("no STL: neither facets of three vertices nor as many bytes as it says")
    return np.array([[float(value) for value in row] for row in numbers]).reshape(-1, 3, 3)


def _obj(path: str, content: bytes) -> np.ndarray:
    """Wavefront OBJ: faces count vertices from 1, or from the last one backwards."""
    corners, found = [], []
    for line in content.decode("utf-8", "replace").splitlines():
        key, *values = line.split() or [""]
        if key == "v":
            corners.append([float(value) for value in values[:3]])
        elif key == "f":
            at = [int(value.split("/")[0]) for value in values]
            if min(at, default=0) < -len(corners):
                raise IndexError
            found += _fan([index - 1 if index > 0 else index for index in at])
    return np.array(corners).reshape(-1, 3)[np.array(found, int).reshape(-1, 3)]


def _fan(corners: list[int]) -> list[tuple[int, int, int]]:
    """The triangles of a polygon around its first corner."""
    return [(corners[0], *pair) for pair in zip(corners[1:], corners[2:], strict=False)]


def _dae(path: str, content: bytes) -> np.ndarray:
    """COLLADA 1.4: the geometries that the nodes of its scenes instantiate."""
    root = outside_xml.parse(path, content)
    named = {element.attributes["id"]: element for element in _walk(root)
             if "id" in element.attributes and element.tag in ("geometry", "node", "source",
                                                               "vertices")}
    asset = root.first("asset")
    unit = asset.first("unit") if asset else None
    metre = float(unit.attributes.get("meter", 1.0)) if unit else 1.0
    scenes = [scene for library in root.all("library_visual_scenes")
              for scene in library.all("visual_scene")]
    placed = [piece for scene in scenes
              for piece in _of_node(scene, np.eye(4), named, _DEEPEST)]
    if sum(map(len, placed)) > _MOST_TRIANGLES:
        raise ValueError(f"more than {_MOST_TRIANGLES} triangles")
    return np.concatenate([np.empty((0, 3, 3)), *placed]) * metre


def _walk(element: Element) -> Iterator[Element]:
    yield element
    for child in element.children:
        yield from _walk(child)


def _of_node(node: Element, above: np.ndarray, named: dict[str, Element], deepest: int,
             ) -> Iterator[np.ndarray]:
    if deepest == 0:
        raise ValueError(f"nodes of a scene nested too deeply; at most {_DEEPEST}")
    at = above
    for child in node.children:
        if child.tag in ("matrix", "translate", "scale", "rotate"):
            at = at @ _transform(child)
        elif child.tag == "node":
            yield from _of_node(child, at, named, deepest - 1)
        elif child.tag in ("instance_node", "instance_geometry"):
            other = named.get(child.attributes.get("url", "").removeprefix("#"))
            if other is not None and other.tag == "node":
                yield from _of_node(other, at, named, deepest - 1)
            elif other is not None:
                for mesh in other.all("mesh"):
                    yield _of_collada(mesh, named) @ at[:3, :3].T + at[:3, 3]


def _transform(element: Element) -> np.ndarray:
    values = np.array(element.text.split(), float)
    if len(values) != {"matrix": 16, "rotate": 4}.get(element.tag, 3):
        raise ValueError(f"line {element.line}: <{element.tag}> has {len(values)} numbers")
    at = np.eye(4)
    if element.tag == "matrix":
        return values.reshape(4, 4)
    if element.tag == "translate":
        at[:3, 3] = values
    elif element.tag == "scale":
        at[:3, :3] = np.diag(values)
    else:
        at[:3, :3] = around(values[:3], float(np.radians(values[3])))
    return at


def around(axis: np.ndarray, angle_rad: float) -> np.ndarray:
    """The rotation [3, 3] around an axis (Rodrigues' formula)."""
    x, y, z = axis / (np.linalg.norm(axis) or 1.0)
    cross = np.array([(0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)])
    return np.eye(3) + np.sin(angle_rad) * cross + (1.0 - np.cos(angle_rad)) * cross @ cross


def _of_collada(mesh: Element, named: dict[str, Element]) -> np.ndarray:
    """[n, 3, 3] the triangles and polygons of a mesh."""
    pieces = [np.empty((0, 3, 3))]
    for faces in mesh.all("triangles", "polylist", "polygons"):
        inputs = list(faces.all("input"))
        width = 1 + max((int(given.attributes.get("offset", 0)) for given in inputs), default=0)
        vertex = next((given for given in inputs
                       if given.attributes.get("semantic") == "VERTEX"), None)
        source = vertex and named.get(vertex.attributes.get("source", "").removeprefix("#"))
        corners = _positions(source, named) if source else None
        if vertex is None or corners is None:
            raise ValueError(f"line {faces.line}: <{faces.tag}> has no positions")
        lists = [np.array(p.text.split(), int).reshape(-1, width)
                 [:, int(vertex.attributes.get("offset", 0))] for p in faces.all("p")]
        counts = faces.first("vcount")
        if faces.tag == "triangles":
            at = np.concatenate([np.empty(0, int), *lists]).reshape(-1, 3)
        else:
            if counts is not None and lists:
                ends = np.cumsum(np.array(counts.text.split(), int))
                lists = np.split(lists[0], ends[:-1])
            at = np.array([corner for one in lists for corner in _fan(one.tolist())],
                          int).reshape(-1, 3)
        pieces.append(corners[at])
    return np.concatenate(pieces)


def _positions(source: Element, named: dict[str, Element]) -> np.ndarray | None:
    """[n, 3] of a source, or of the one that ``vertices`` name."""
    if source.tag == "vertices":
        given = next((given for given in source.all("input")
                      if given.attributes.get("semantic") == "POSITION"), None)
        inner = given and named.get(given.attributes.get("source", "").removeprefix("#"))
        return _positions(inner, named) if inner and inner.tag == "source" else None
    values = source.first("float_array")
    return None if values is None else np.array(values.text.split(), float).reshape(-1, 3)


_FORMS = {"stl": _stl, "obj": _obj, "dae": _dae}
