"""Path data of SVG (``d`` of a path), as chains of points; SVG 1.1, chapters 8.3 and F.6."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from desim.imports.terrains.curves import arc, bezier
from desim.imports.terrains.found import Point

_NUMBER = re.compile(r"[\s,]*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)")
_FLAG = re.compile(r"[\s,]*([01])")
_COMMAND = re.compile(r"[\s,]*([MmZzLlHhVvCcSsQqTtAa])")
_ARGUMENTS = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}


class Chain(NamedTuple):
    """Points one after the other, and whether the last one is joined to the first."""

    points: list[Point]
    is_closed: bool


def chains(data: str) -> list[Chain]:
    """The parts of a path. Raises ``ValueError``."""
    return _Path(data).chains


class _Path:
    """A path while it is read."""

    def __init__(self, data: str) -> None:
        self.chains: list[Chain] = []
        self._data, self._at = data, 0
        self._points: list[Point] = []
        self._here: Point = (0.0, 0.0)
        self._pole: Point = (0.0, 0.0)  # the last one of the curve before
        before = ""
        while self._data[self._at:].strip(" \t\r\n,"):
            if found := _COMMAND.match(self._data, self._at):
                self._at, letter = found.end(), found[1]
            elif before in ("", "Z", "z"):
                raise ValueError(self._wrong("a command"))
            else:
                letter = {"M": "L", "m": "l"}.get(before, before)
            self._draw(letter, before.upper())
            before = letter
        self._end(False)

    def _draw(self, letter: str, before: str) -> None:
        kind, numbers = letter.upper(), self._numbers(letter.upper())
        x, y = self._here if letter.islower() else (0.0, 0.0)
        poles = [(x + a, y + b) for a, b in zip(numbers[0::2], numbers[1::2], strict=False)]
        here = self._here
        if kind == "M":
            self._end(False)
            self._points, self._here = [poles[0]], poles[0]
        elif kind == "Z":
            self._end(True)
        elif kind == "A":
            self._add(_arc(here, numbers, (x + numbers[5], y + numbers[6])))
        elif kind in "LHV":
            self._add([poles[0] if kind == "L" else (x + numbers[0], here[1]) if kind == "H" else
                       (here[0], y + numbers[0])])
        else:
            if kind in "ST":
                smooth = before in ("CS" if kind == "S" else "QT")
                poles.insert(0, (2 * here[0] - self._pole[0], 2 * here[1] - self._pole[1])
                             if smooth else here)
            self._add(bezier([here, *poles]))
            self._pole = poles[-2]

    def _add(self, points: list[Point]) -> None:
        if not self._points:  # behind the end of a closed part
            self._points.append(self._here)
        self._points += points
        self._here = points[-1]

    def _end(self, is_closed: bool) -> None:
        if len(self._points) > 1:
            self.chains.append(Chain(self._points, is_closed))
        if self._points:
            self._here = self._points[0]
        self._points = []

    def _numbers(self, kind: str) -> list[float]:
        found = []
        for number in range(_ARGUMENTS[kind]):
            pattern = _FLAG if kind == "A" and number in (3, 4) else _NUMBER
            match = pattern.match(self._data, self._at)
            if match is None:
                raise ValueError(self._wrong("a number"))
            self._at = match.end()
            found.append(float(match[1]))
        return found

    def _wrong(self, wanted: str) -> str:
        rest = self._data[self._at:].strip()[:20]
        return f"{wanted} must stand in the path data at {rest!r}" if rest else (
            f"the path data end where {wanted} must stand")


def _arc(start: Point, numbers: list[float], end: Point) -> list[Point]:
    """The points of an elliptical arc behind its start (F.6.5 and F.6.6 of the standard)."""
    rx, ry, turn_deg, large, sweeps = (*map(abs, numbers[:2]), *numbers[2:5])
    if rx == 0.0 or ry == 0.0 or start == end:
        return [end]
    turn = math.radians(turn_deg)
    cos, sin = math.cos(turn), math.sin(turn)
    dx, dy = (start[0] - end[0]) / 2, (start[1] - end[1]) / 2
    x, y = cos * dx + sin * dy, cos * dy - sin * dx
    grown = math.sqrt(max(1.0, (x / rx) ** 2 + (y / ry) ** 2))
    rx, ry = rx * grown, ry * grown
    square = (x / rx) ** 2 + (y / ry) ** 2
    factor = math.sqrt(max(0.0, 1.0 / square - 1.0)) * (-1.0 if large == sweeps else 1.0)
    cx, cy = factor * rx * y / ry, -factor * ry * x / rx
    centre = (cos * cx - sin * cy + (start[0] + end[0]) / 2,
              sin * cx + cos * cy + (start[1] + end[1]) / 2)
    first = math.atan2((y - cy) / ry, (x - cx) / rx)
    swept = (math.atan2((-y - cy) / ry, (-x - cx) / rx) - first) % (2 * math.pi)
    return [*arc(centre, rx, ry, first, swept if sweeps else swept - 2 * math.pi, turn)[1:-1], end]
