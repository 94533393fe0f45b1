"""The starts of robots: whether one is free, and the nearest place that is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from desim.errors import InputError
from desim.scenario.schema.fleet import BodyType, StartRandom
from desim.world.fleet import RobotSpec
from desim.world.geometry import point_distance
from desim.world.kernels import outline as contacts
from desim.world.outlines import Outlines
from desim.world.terrain import Terrain

SNAP_STEP_M = 0.1  # half a cell of the paper's maps: places to snap to lie on such a lattice
_AT_ONCE = 1024  # places drawn, or tested, in one go
_FEW = 32  # places tested at first: one of them is free nearly always
_DRAWS = 16  # times so many: of a free share of 0.1 % nothing is found once in 1e7 cases
_SLACK_M = 1e-6


class Site:
    """Finds free starts, clear of the terrain, closed doors, discs and the robots placed before.
    ``stream(name)`` gives the random numbers of a robot's start. Where it is drawn or moved, the
    whole circle around its body is free, so that it can turn."""

    def __init__(self, terrain: Terrain, doors: np.ndarray, discs: np.ndarray,
                 stream: Callable[[str], np.random.Generator]) -> None:
        self._terrain, self._doors, self._discs = terrain, doors, discs
        self._stream = stream
        self._placed: dict[str, RobotSpec] = {}

    def place(self, specs: list[RobotSpec]) -> list[RobotSpec]:
        """``specs`` with legal starts; those that snap are placed after the others, in order, and
        those with a path, which are where that begins, before them.

        Raises ``InputError`` for the first start that is not allowed.
        """
        placed = self._placed
        placed |= {spec.name: spec for spec in specs if spec.path is not None}
        for spec in specs:
            if spec.path is not None:
                continue
            if spec.drawn is not None:
                placed[spec.name] = self._drawn(spec, spec.drawn)
                continue
            trouble = self._trouble(spec)
            if trouble is None:
                placed[spec.name] = spec
            elif not spec.snap or not self._within(spec):
                raise InputError(f"fleet.start: the start of {spec.name} at ({spec.x_m:g}, "
                                 f"{spec.y_m:g}) m {trouble}")
        for spec in specs:
            if spec.name not in placed:
                placed[spec.name] = self._snapped(spec)
        return [placed[spec.name] for spec in specs]

    def _within(self, spec: RobotSpec) -> bool:
        """Whether the start lies in the terrain's bounds. Outside, the frame of reference is
        wrong, and the nearest free place would be none that was meant."""
        x0, y0, x1, y1 = self._terrain.bounds
        return x0 < spec.x_m < x1 and y0 < spec.y_m < y1

    def _trouble(self, spec: RobotSpec) -> str | None:
        if not self._within(spec):
            x0, y0, x1, y1 = self._terrain.bounds
            return (f"lies outside the terrain; allowed: x between {x0:g} and {x1:g} m, y between "
                    f"{y0:g} and {y1:g} m, the edges themselves left out")
        outline = _outline(spec)
        if self._is_in_matter(spec, outline):
            what = ("or its footprint reaches into one" if len(outline) else
                    f"or closer to one than its radius of {spec.body.radius_m:g} m")
            return (f"lies in a wall {what}; allowed: a free place, or start.snap: true to move it "
                    "to the nearest one")
        for other in self._placed.values():
            apart = float(np.hypot(other.x_m - spec.x_m, other.y_m - spec.y_m))
            needed = spec.body.radius_m + other.body.radius_m
            if apart >= needed - _SLACK_M or not _overlap(spec, outline, other):
                continue
            allowed = ("footprints that do not overlap" if spec.body.footprint
                       or other.body.footprint else f"at least {needed:g} m apart")
            return (f"is {apart:g} m from that of {other.name} at ({other.x_m:g}, {other.y_m:g}) "
                    f"m; allowed: {allowed}, or start.snap: true to move it to the nearest free "
                    "place")
        return None

    def _is_in_matter(self, spec: RobotSpec, outline: np.ndarray) -> bool:
        """Whether something that is in the way of it overlaps its body."""
        body = spec.body
        clear_m = self._clearance(np.array([[spec.x_m, spec.y_m]]), body)[0]
        if clear_m >= body.radius_m - _SLACK_M:
            return False
        if clear_m < 0.0 or not len(outline):
            return True
        walls = np.concatenate([self._terrain.above(body.passes_m).walls, self._doors])
        near = point_distance(np.array([[spec.x_m, spec.y_m]]), walls)[0] < body.radius_m
        return any(contacts.overlap(outline, line, contacts.NONE)[0] > _SLACK_M
                   for line in walls[near].reshape(-1, 2, 2)) or any(
            contacts.against_disc(outline, x, y, radius, contacts.NONE)[0] > _SLACK_M
            for x, y, radius in self._discs.tolist())

    def _drawn(self, spec: RobotSpec, drawn: StartRandom) -> RobotSpec:
        """The first free place among random ones."""
        rng = self._stream(spec.name)
        x0, y0, x1, y1 = self._terrain.bounds
        (ax, ay), (bx, by) = drawn.within_m or ((x0, y0), (x1, y1))
        for _ in range(_DRAWS):
            points = rng.uniform((min(ax, bx), min(ay, by)), (max(ax, bx), max(ay, by)),
                                 (_AT_ONCE, 2))
            inside = ((points > (x0, y0)) & (points < (x1, y1))).all(axis=1)
            first = self._first_free(points[inside], spec.body, drawn.apart_m)
            if first is not None:
                yaw = float(rng.uniform(-np.pi, np.pi))
                return spec._replace(x_m=first[0], y_m=first[1], yaw_rad=yaw, drawn=None)
        raise InputError(f"fleet.start: no free place for {spec.name} among {_DRAWS * _AT_ONCE} "
                         f"that were drawn, {len(self._placed)} robots being placed; allowed: "
                         f"fewer robots, a smaller apart than {drawn.apart_m:g} m or a wider "
                         "within")

    def _snapped(self, spec: RobotSpec) -> RobotSpec:
        """The nearest free place on a lattice around the start, the heading as it was."""
        x0, y0, x1, y1 = self._terrain.bounds
        farthest = float(np.hypot(max(abs(spec.x_m - x0), abs(spec.x_m - x1)),
                                  max(abs(spec.y_m - y0), abs(spec.y_m - y1))))
        reach = 1.0
        while reach < 2.0 * farthest:
            lattice = _lattice(reach) + (spec.x_m, spec.y_m)
            first = self._first_free(lattice, spec.body)
            if first is not None:
                return spec._replace(x_m=first[0], y_m=first[1])
            reach *= 2.0
        raise InputError(f"fleet.start: no free place for {spec.name} with a radius of "
                         f"{spec.body.radius_m:g} m anywhere in terrain {self._terrain.name!r}")

    def _first_free(self, points: np.ndarray, body: BodyType,
                    apart_m: float = 0.0) -> tuple[float, float] | None:
        """The first of ``points`` where such a robot fits, at least ``apart_m`` from the middles of
        others."""
        radius_m = body.radius_m
        others = np.array([(other.x_m, other.y_m, other.body.radius_m)
                           for other in self._placed.values()]).reshape(-1, 3)
        needed_m = np.maximum(others[:, 2] + radius_m, apart_m)
        for some in np.split(points, range(_FEW, len(points), _AT_ONCE)):
            free = (np.hypot(some[:, 0, None] - others[:, 0], some[:, 1, None] - others[:, 1])
                    >= needed_m).all(axis=1)
            if free.any():
                free[free] = self._clearance(some[free], body) >= radius_m - _SLACK_M
            if free.any():
                x, y = some[int(np.argmax(free))].tolist()
                return x, y
        return None

    def _clearance(self, points: np.ndarray, body: BodyType) -> np.ndarray:
        """[k] m to the nearest matter that is in the way of ``body``, at most its radius."""
        clear = self._terrain.above(body.passes_m).clearance(points, body.radius_m)
        if len(self._doors):
            clear = np.minimum(clear, point_distance(points, self._doors).min(axis=1))
        for x, y, radius in self._discs.tolist():
            clear = np.minimum(clear, np.hypot(points[:, 0] - x, points[:, 1] - y) - radius)
        return clear


def _outline(spec: RobotSpec) -> np.ndarray:
    """[k, 2] m the corners of its body at its start; a disc has none."""
    pose = np.array([(spec.x_m, spec.y_m, spec.yaw_rad)])
    return Outlines([spec.body]).at(pose).placed if spec.body.footprint else np.zeros((0, 2))


def _overlap(spec: RobotSpec, outline: np.ndarray, other: RobotSpec) -> bool:
    """Whether two bodies overlap of which the circles do; that of ``spec`` has this ``outline``."""
    theirs = _outline(other)
    if len(outline) and len(theirs):
        return contacts.overlap(outline, theirs, contacts.NONE)[0] > _SLACK_M
    if not len(outline) and not len(theirs):
        return True
    polygon, disc = (outline, other) if len(outline) else (theirs, spec)
    return contacts.against_disc(polygon, disc.x_m, disc.y_m, disc.body.radius_m,
                                 contacts.NONE)[0] > _SLACK_M


def _lattice(reach_m: float) -> np.ndarray:
    """[k, 2] offsets in a circle, nearest first, ties by y, then x."""
    steps = int(round(reach_m / SNAP_STEP_M))
    line = np.arange(-steps, steps + 1)
    dx, dy = (axis.ravel() for axis in np.meshgrid(line, line))
    distance2 = dx * dx + dy * dy
    order = np.lexsort((dx, dy, distance2))
    order = order[distance2[order] <= steps * steps]
    return np.column_stack([dx[order], dy[order]]) * SNAP_STEP_M
