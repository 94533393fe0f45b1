"""Floor plans in SVG: strokes are walls as thick as they are drawn, filled shapes are blocks.

As in images, what is nearer to black than to white is solid. Paler shapes free the ground that they
cover of blocks drawn before them, as rooms do that are painted on a dark house.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from itertools import pairwise
from pathlib import Path

import numpy as np

from desim import outside_xml
from desim.errors import InputError, did_you_mean
from desim.imports.terrains import svg_path, svg_style
from desim.imports.terrains.areas import Area, trapezoids, visible
from desim.imports.terrains.curves import Affine, circle, turned
from desim.imports.terrains.found import Choices, ImportedPlan, Point
from desim.imports.terrains.picture import HEIGHT_M, MATERIAL
from desim.imports.terrains.svg_path import Chain
from desim.imports.terrains.svg_style import Style, StyleSheet, number
from desim.outside_xml import Element

_UNITS_M = {"mm": 1e-3, "cm": 1e-2, "in": 0.0254, "pt": 0.0254 / 72, "pc": 0.0254 / 6}
_SMALLEST_M = 3.0  # a drawing that is smaller is one on paper
_MOST_CORNERS = 1000  # of a polygon in a scenario
_MOST_ELEMENTS, _DEEPEST = 500_000, 200  # with those that <use> repeats
_TRANSFORM = re.compile(r"\b(\w+)\s*\(([^()]*)\)")
_GROUPS = ("svg", "g", "a", "switch", "symbol")
_LEFT_OUT = {"text": "texts", "image": "images", "foreignObject": "foreign objects"}


def read(path: Path, choices: Choices) -> ImportedPlan:
    """The plan that a drawing shows. Raises ``InputError``."""
    root = outside_xml.read(path)
    plan = ImportedPlan()
    scale = choices.scale or _scale(path, root, plan)
    drawing = _Drawing(path, root, choices)
    drawing.walk(root, Affine(scale, 0.0, 0.0, -scale), {}, choices.level is None, 0)
    drawing.give(plan)
    return plan


class _Drawing:
    """A drawing while it is read: walls, and filled areas in the order of painting."""

    def __init__(self, path: Path, root: Element, choices: Choices) -> None:
        self._path, self._choices = path, choices
        self._sheet = StyleSheet(root)
        self._by_id: dict[str, Element] = {}
        self._layers: list[str] = []
        self._index(root)
        if choices.level is not None and choices.level not in {*self._layers, *self._by_id}:
            raise InputError(f"--level {choices.level}: {path} has no such layer or id"
                             f"{did_you_mean(choices.level, [*self._layers, *self._by_id])}; "
                             f"layers: {', '.join(self._layers) or 'none'}")
        # Points, width and the number of areas below of dark and of pale lines.
        self._lines: dict[bool, list[tuple[list[Point], float, int]]] = {True: [], False: []}
        self._areas: list[tuple[bool, Area]] = []
        self._left_out: Counter[str] = Counter()
        self._elements = 0

    def _index(self, element: Element) -> None:
        given = element.attributes
        if "id" in given:
            self._by_id.setdefault(given["id"], element)
        if given.get("inkscape:groupmode") == "layer":
            self._layers.append(given.get("inkscape:label", given.get("id", "")))
        for child in element.children:
            self._index(child)

    def walk(self, element: Element, place: Affine, outer: Style, chosen: bool, depth: int) -> None:
        """Collect what an element and those in it draw."""
        self._elements += 1
        if self._elements > _MOST_ELEMENTS or depth > _DEEPEST:
            raise self._wrong(element, f"more than {_MOST_ELEMENTS} elements, or nested more than "
                                       f"{_DEEPEST} deep, with all that <use> repeats")
        given, style = element.attributes, self._sheet.of(element, outer)
        if style.get("display") == "none":
            self._left_out["hidden elements"] += 1
            return
        place = place.after(self._transform(element))
        chosen = chosen or self._choices.level in (given.get("id"), given.get("inkscape:label"))
        if element.tag in _GROUPS:
            if element.tag == "svg" and depth:
                place = place.after(self._moved(given))
            for child in element.children:
                if child.tag != "symbol":
                    self.walk(child, place, style, chosen, depth + 1)
        elif element.tag == "use":
            name = given.get("href", given.get("xlink:href", ""))
            if (meant := self._by_id.get(name.removeprefix("#"))) is not None:
                self.walk(meant, place.after(self._moved(given)), style, chosen, depth + 1)
        elif chosen and element.tag in _LEFT_OUT:
            self._left_out[_LEFT_OUT[element.tag]] += 1
        elif chosen and svg_style.is_shown(style):
            self._draw([Chain(place.of(points), is_closed)
                        for points, is_closed in self._chains(element)], style, place.scale)

    def _draw(self, chains: list[Chain], style: Style, scale: float) -> None:
        if not chains:
            return
        fill, stroke = self._paint(style, "fill"), self._paint(style, "stroke")
        rings = tuple(tuple(points) for points, _ in chains if len(points) > 2)
        if rings and fill is not None:
            self._areas.append((fill, Area(rings, style.get("fill-rule") == "evenodd")))
        width = number(style.get("stroke-width", "1"), 1.0)
        if fill and rings:
            return
        if stroke is not None and width > 0.0:
            self._lines[stroke] += [([*points, points[0]] if is_closed else points, scale * width,
                                     len(self._areas)) for points, is_closed in chains]

    def _paint(self, style: Style, what: str) -> bool | None:
        try:
            return svg_style.paint(style, what)
        except ValueError:
            self._left_out["colours that cannot be read"] += 1
            return None

    def _chains(self, element: Element) -> list[Chain]:
        given = element.attributes

        def of(name: str, default: float = 0.0) -> float:
            return number(given.get(name, ""), default)

        if element.tag == "path":
            try:
                return svg_path.chains(given.get("d", ""))
            except ValueError as error:
                raise self._wrong(element, str(error)) from None
        if element.tag == "line":
            return [Chain([(of("x1"), of("y1")), (of("x2"), of("y2"))], False)]
        if element.tag in ("polyline", "polygon"):
            numbers = [float(text) for text in re.findall(
                r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", given.get("points", ""))]
            points = list(zip(numbers[0::2], numbers[1::2], strict=False))
            return [Chain(points, element.tag == "polygon")] if len(points) > 1 else []
        if element.tag == "rect":
            x0, y0, x1, y1 = of("x"), of("y"), of("x") + of("width"), of("y") + of("height")
            return [Chain([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], True)] if (
                x1 > x0 and y1 > y0) else []
        if element.tag in ("circle", "ellipse"):
            rx, ry = of("r" if element.tag == "circle" else "rx"), of(
                "r" if element.tag == "circle" else "ry")
            return [Chain(circle((of("cx"), of("cy")), rx, ry), True)] if rx * ry > 0.0 else []
        return []

    def _transform(self, element: Element) -> Affine:
        place = Affine()
        for name, text in _TRANSFORM.findall(element.attributes.get("transform", "")):
            try:
                place = place.after(_affine(name, [float(word) for word in
                                                   text.replace(",", " ").split()]))
            except (ValueError, TypeError, IndexError):
                raise self._wrong(element, f"transform {name}({text}) cannot be read") from None
        return place

    @staticmethod
    def _moved(given: dict[str, str]) -> Affine:
        return Affine(e=number(given.get("x", ""), 0.0), f=number(given.get("y", ""), 0.0))

    def _wrong(self, element: Element, reason: str) -> InputError:
        return InputError(f"{self._path}:{element.line}: <{element.tag}>: {reason}")

    def give(self, plan: ImportedPlan) -> None:
        """Add all walls and blocks to a plan, with notes."""
        height_m = self._choices.height_m or HEIGHT_M
        material = self._choices.material or MATERIAL
        pale = [(number_, area, np.array(area.box)) for number_, (is_dark, area)
                in enumerate(self._areas) if not is_dark]
        boxes = np.array([box for *_, box in pale]).reshape(-1, 4)
        are_dark = bool(self._lines[True])
        for points, width_m, below in self._lines[are_dark]:
            for ends in pairwise(points):
                low, high = np.min(ends, axis=0), np.max(ends, axis=0)
                near = np.flatnonzero(((boxes[:, :2] <= high) & (boxes[:, 2:] >= low)).all(axis=1))
                over = [pale[i][1] for i in near.tolist() if pale[i][0] >= below]
                for start, end in visible(*ends, width_m, over):
                    plan.wall(start, end, width_m, height_m, material)
        dark = 0
        for number_, (is_dark, area) in enumerate(self._areas):
            if not is_dark:
                continue
            dark += 1
            over = [other for pale, other in self._areas[number_ + 1:]
                    if not pale and other.meets(area)]
            ring, *holes = area.rings
            for polygon in ([ring] if not over and not holes and len(ring) <= _MOST_CORNERS
                            else trapezoids(area, over)):
                plan.block(polygon, height_m, material)
        shade = ("dark lines" if are_dark or not self._lines[False] else
                 "pale lines, as none is dark,")
        plan.notes.append(f"{len(self._lines[are_dark])} {shade} are walls as thick as they are "
                          f"drawn, {dark} dark shapes are solid")
        self._left_out["pale shapes"] = len(self._areas) - dark
        self._left_out["pale lines"] = are_dark * len(self._lines[False])
        left_out = [f"{count} {what}" for what, count in self._left_out.items() if count]
        if left_out:
            plan.notes.append(f"left out: {', '.join(left_out)}")
        if len(self._layers) > 1 and self._choices.level is None:
            plan.notes.append(f"layers: {', '.join(self._layers)}; --level NAME takes one of them, "
                              "or an element by its id")


def _affine(name: str, numbers: list[float]) -> Affine:
    if name == "matrix" and len(numbers) == 6:
        return Affine(*numbers)
    if name == "translate":
        return Affine(e=numbers[0], f=numbers[1] if len(numbers) > 1 else 0.0)
    if name == "scale":
        return Affine(a=numbers[0], d=numbers[-1])
    if name == "rotate":
        x, y = numbers[1:3] if len(numbers) > 2 else (0.0, 0.0)
        return Affine(e=x, f=y).after(turned(math.radians(numbers[0]))).after(Affine(e=-x, f=-y))
    tangent = math.tan(math.radians(numbers[0]))
    if name == "skewX":
        return Affine(c=tangent)
    if name == "skewY":
        return Affine(b=tangent)
    raise ValueError(name)


def _scale(path: Path, root: Element, plan: ImportedPlan) -> float:
    """m a unit, as the drawing's width says. Raises ``InputError`` where it says none, or one that
    a building does not have."""
    box = [number(word, 0.0) for word in
           root.attributes.get("viewBox", "").replace(",", " ").split()]
    text = root.attributes.get("width", "").strip()
    width = number(text, 0.0)
    unit = text.lstrip("+-.0123456789eE").strip()
    width_m = width * _UNITS_M.get(unit, 0.0)
    units = box[2] if len(box) == 4 and box[2] > 0.0 else (
        width_m * 96 / 0.0254 or width)  # of 96 to the inch, as CSS has it
    advice = (f"give the length of one of its units in m, as in --scale 0.01 (it is "
              f"{units:g} units wide)")
    if width_m <= 0.0:
        raise InputError(f"{path}: the drawing does not say how long its units are; {advice}")
    if width_m < _SMALLEST_M:
        raise InputError(f"{path}: the drawing is {width_m:g} m wide, as on paper; {advice}")
    scale = width_m / units
    plan.notes.append(f"a unit is {scale:g} m, as the width {text} says (--scale)")
    return scale
