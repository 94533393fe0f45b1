"""Floor plans in DXF: lines, polylines, circles, arcs, ellipses, splines, solids and blocks.

Codes are those of Autodesk's DXF Reference. Layers that are off or frozen are left out, and those
for doors, furniture, texts and dimensions by the names of the AIA CAD Layer Guidelines, unless
``--level`` names layers: a plan shows open doors with the arc of their swing.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from desim.errors import InputError, did_you_mean
from desim.imports.terrains import dxf_tags
from desim.imports.terrains.areas import Area, trapezoids
from desim.imports.terrains.curves import Affine, arc, turned
from desim.imports.terrains.dxf_tags import Document, Entity
from desim.imports.terrains.found import Choices, ImportedPlan, Point
from desim.imports.terrains.picture import HEIGHT_M, MATERIAL

_SMALLEST_M = 1.0  # a plan that is smaller has other units than it says
_THICKNESS_M = 0.1  # of a line without a width
# $INSUNITS: inches, feet, miles, mm, cm, m, km, then microinches to parsecs, of which some are used
_UNITS_M = {1: 0.0254, 2: 0.3048, 4: 1e-3, 5: 1e-2, 6: 1.0, 7: 1e3, 10: 0.9144, 14: 0.1}
_ASIDE = re.compile(r"DOOR|FURN|ANNO|DIM|TEXT|GRID|AREA|EQPM|DEFPOINTS", re.IGNORECASE)
_DEEPEST, _MOST_ENTITIES = 16, 500_000  # of blocks in blocks; with all that blocks repeat
_SOLIDS = ("SOLID", "TRACE")  # filled triangles and quadrangles
_DRAWN = ("LINE", "LWPOLYLINE", "POLYLINE", "CIRCLE", "ARC", "ELLIPSE", "SPLINE", "INSERT",
          *_SOLIDS)


def read(path: Path, choices: Choices) -> ImportedPlan:
    """The plan of a drawing's model space. Raises ``InputError``."""
    document, plan = dxf_tags.read(path), ImportedPlan()
    drawing = _Drawing(path, document, choices, plan)
    scale = choices.scale or _scale(path, document, plan)
    for entity in document.entities:
        drawing.draw(entity, Affine(scale, 0.0, 0.0, scale), "", 0)
    drawing.note()
    if choices.scale is None and 0.0 < plan.side_m < _SMALLEST_M:
        raise InputError(f"{path}: the drawing is {plan.side_m:.2g} m wide if $INSUNITS is right; "
                         "give the length of one of its units in m, as in --scale 1")
    return plan


class _Drawing:
    """A drawing while its entities become walls."""

    def __init__(self, path: Path, document: Document, choices: Choices, plan: ImportedPlan
                 ) -> None:
        self._path, self._document, self._plan = path, document, plan
        self._height_m = choices.height_m or HEIGHT_M
        self._material = choices.material or MATERIAL
        self._chosen = None if choices.level is None else [
            name.strip() for name in choices.level.split(",")]
        for name in self._chosen or ():
            if name not in document.layers:
                raise InputError(f"--level {name}: {path} has no such layer"
                                 f"{did_you_mean(name, document.layers)}; allowed: "
                                 f"{', '.join(sorted(document.layers)) or 'none'}")
        self._entities = 0
        self._drawn: Counter[str] = Counter()  # by layer
        self._aside: Counter[str] = Counter()
        self._left_out: Counter[str] = Counter()

    def draw(self, entity: Entity, place: Affine, outer: str, depth: int) -> None:
        """Add the walls of an entity; ``outer`` is the layer of the block that it is in."""
        self._entities += 1
        if self._entities > _MOST_ENTITIES or depth > _DEEPEST:
            raise InputError(f"{self._path}: more than {_MOST_ENTITIES} entities, or blocks nested "
                             f"more than {_DEEPEST} deep")
        if entity.flags(67) or entity.flags(60):  # in paper space, or invisible
            return
        layer = entity.text(8, "0")
        layer = outer if layer == "0" and outer else layer
        if entity.kind not in _DRAWN:
            self._left_out[entity.kind] += 1
        elif not self._is_hidden(layer):
            if entity.kind == "INSERT":
                self._insert(entity, place, layer, depth)
            elif self._is_aside(layer):
                self._aside[layer] += 1
            else:
                self._drawn[layer] += 1
                self._add(entity, place)

    def _is_hidden(self, layer: str) -> bool:
        """Whether a layer is off, which its negative colour says, or frozen."""
        facts = self._document.layers.get(layer)
        if facts is None or not (facts.number(62) < 0 or facts.flags() & 1):
            return False
        self._left_out["entities of hidden layers"] += 1
        return True

    def _is_aside(self, layer: str) -> bool:
        return (bool(_ASIDE.search(layer)) if self._chosen is None else layer not in self._chosen)

    def _insert(self, entity: Entity, place: Affine, layer: str, depth: int) -> None:
        block = self._document.blocks.get(entity.text(2))
        if block is None:
            self._left_out["missing blocks"] += 1
            return
        base_x, base_y = block.point(10)
        x, y = entity.point(10)
        turn = turned(math.radians(entity.number(50)))
        scaled = Affine(entity.number(41, 1.0), 0.0, 0.0, entity.number(42, 1.0))
        for row in range(max(1, entity.flags(71))):
            for column in range(max(1, entity.flags(70))):
                step = turn.at((column * entity.number(44), row * entity.number(45)))
                at = place.after(_mirrored(entity)).after(
                    Affine(e=x + step[0], f=y + step[1])).after(turn).after(scaled).after(
                    Affine(e=-base_x, f=-base_y))
                for part in block.parts:
                    self.draw(part, at, layer, depth + 1)

    def _add(self, entity: Entity, place: Affine) -> None:
        points = _points(entity)
        width = entity.number(43) or entity.number(40) * (entity.kind == "POLYLINE")
        in_place = place if entity.kind in ("LINE", "ELLIPSE", "SPLINE") else place.after(
            _mirrored(entity))
        corners = in_place.of(points)
        if entity.kind in _SOLIDS:
            for polygon in trapezoids(Area((tuple(corners),), True), []):
                self._plan.block(polygon, self._height_m, self._material)
            return
        for start, end in zip(corners, corners[1:], strict=False):
            self._plan.wall(start, end, width * place.scale or _THICKNESS_M, self._height_m,
                            self._material)

    def note(self) -> None:
        """Say what was taken and what was left out."""
        notes = self._plan.notes
        notes.append("walls are the lines of the layers " + _counts(self._drawn))
        if self._aside:
            notes.append(f"left out are the layers {_counts(self._aside)} (--level NAME,NAME "
                         "takes layers)")
        if self._left_out:
            notes.append(f"left out: {_counts(self._left_out)}")


def _points(entity: Entity) -> list[Point]:
    """The points of an entity, in its own plane."""
    if entity.kind == "LINE":
        return [entity.point(10), entity.point(11)]
    if entity.kind in ("CIRCLE", "ARC"):
        start, end = (0.0, 360.0) if entity.kind == "CIRCLE" else (entity.number(50),
                                                                   entity.number(51))
        radius = abs(entity.number(40))
        return arc(entity.point(10), radius, radius, math.radians(start),
                   math.radians((end - start) % 360.0 or 360.0))
    if entity.kind == "ELLIPSE":
        x, y = entity.point(11)
        radius, start = math.hypot(x, y), entity.number(41)
        sweep = (entity.number(42, 2 * math.pi) - start) % (2 * math.pi) or 2 * math.pi
        sign = -1.0 if entity.number(230, 1.0) < 0.0 else 1.0
        return arc(entity.point(10), radius, sign * radius * entity.number(40, 1.0), start, sweep,
                   math.atan2(y, x))
    if entity.kind == "SPLINE":
        return _spline(entity)
    if entity.kind in _SOLIDS:  # the fourth corner, if there is one, is between these
        return [point for code in (10, 11, 13, 12) for point in entity.points(code)]
    if entity.kind == "LWPOLYLINE":
        return _bulged(_lw_vertices(entity), bool(entity.flags() & 1))
    return _bulged([(vertex.point(10), vertex.number(42)) for vertex in entity.parts
                    if not vertex.flags() & 16],  # the frame of a spline's control points
                   bool(entity.flags() & 1))


def _lw_vertices(entity: Entity) -> list[tuple[Point, float]]:
    """Each vertex with the bulge of the side behind it: pairs after a code 10 belong to it."""
    found: list[tuple[Point, float]] = []
    ys, bulges = entity.numbers(20), entity.numbers(42)
    xs = entity.numbers(10)
    for code, _, _ in entity.pairs:
        if code == 10:
            found.append(((next(xs), next(ys, 0.0)), 0.0))
        elif code == 42 and found:
            found[-1] = (found[-1][0], next(bulges))
    return found


def _bulged(vertices: Sequence[tuple[Point, float]], is_closed: bool) -> list[Point]:
    """A polyline whose sides are arcs: a bulge is the tangent of a quarter of the arc's angle,
    positive where it turns anticlockwise."""
    points = [vertices[0][0]] if vertices else []
    ends = [*vertices[1:], *(vertices[:1] if is_closed else ())]
    for ((x1, y1), bulge), (end, _) in zip(vertices, ends, strict=False):
        x2, y2 = end
        if abs(bulge) < 1e-9 or (x1, y1) == end:
            points.append(end)
            continue
        away = (1 / bulge - bulge) / 4  # from the middle of the side, in lengths of the side
        centre = ((x1 + x2) / 2 - away * (y2 - y1), (y1 + y2) / 2 + away * (x2 - x1))
        radius = math.dist(centre, end)
        points += arc(centre, radius, radius, math.atan2(y1 - centre[1], x1 - centre[0]),
                      4 * math.atan(bulge))[1:]
    return points


def _spline(entity: Entity) -> list[Point]:
    """The points that a spline was fitted to, or else its curve, of which weights are left out."""
    fitted, poles = entity.points(11), entity.points(10)
    degree, knots = int(entity.number(71, 3.0)), list(entity.numbers(40))
    if len(knots) != len(poles) + degree + 1 or degree > 20 or degree < 1:
        return fitted or poles
    inner = sorted(set(knots[degree:-degree]))
    points: list[Point] = []
    for low, high in zip(inner, inner[1:], strict=False):
        span = max(i for i in range(degree, len(poles)) if knots[i] <= low)
        for part in range(9):
            points.append(_de_boor(poles, knots, degree, span, low + (high - low) * part / 8))
    return points or fitted or poles


def _de_boor(poles: list[Point], knots: list[float], degree: int, span: int, t: float) -> Point:
    found = [poles[span - degree + i] for i in range(degree + 1)]
    for level in range(1, degree + 1):
        for i in range(degree, level - 1, -1):
            low = knots[i + span - degree]
            wide = knots[i + 1 + span - level] - low
            share = (t - low) / wide if wide else 0.0
            found[i] = (found[i - 1][0] + share * (found[i][0] - found[i - 1][0]),
                        found[i - 1][1] + share * (found[i][1] - found[i - 1][1]))
    return found[degree]


def _mirrored(entity: Entity) -> Affine:
    """The plane of an entity that is seen from below has its x turned over."""
    return Affine(-1.0 if entity.number(230, 1.0) < 0.0 else 1.0)


def _scale(path: Path, document: Document, plan: ImportedPlan) -> float:
    """m a unit. Raises ``InputError`` where the drawing does not say it."""
    text = document.variables.get("$INSUNITS", "0")
    unit_m = _UNITS_M.get(int(text) if text.isdigit() else 0)
    if unit_m is None:
        raise InputError(f"{path}: the drawing does not say how long its units are ($INSUNITS "
                         f"{text}); give the length of one in m, as in --scale 0.001 for mm")
    plan.notes.append(f"a unit is {unit_m:g} m, as $INSUNITS says (--scale)")
    return unit_m


def _counts(counter: Counter[str]) -> str:
    return ", ".join(f"{name} ({count})" for name, count in counter.most_common(20)) or "none"
