"""People who walk along ways by the social force model (Helbing and Molnar 1995), and in groups."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from desim.compiler.kernel import compiled_function
from desim.errors import InputError
from desim.ports.worlds import RandomStreams
from desim.scenario.schema.environment import People
from desim.units import LENGTH
from desim.world.geometry import TOUCH_M, point_distance
from desim.world.kernels import people as kernels
from desim.world.obstacles import crossing
from desim.world.terrain import Terrain
from desim.world.wall_index import TileIndex, tile_index

HEIGHT_M = 1.7  # of a blocker of radio waves (3GPP TR 38.901, 7.6.4.2); lasers above see nobody
RADIUS_M = 0.25  # half the breadth of shoulders (Weidmann 1993: 0.46 m and some)
WANTED_MPS, SPREAD_MPS = 1.34, 0.26  # of people's speeds, mean and standard deviation (the paper)
_SLOWEST_MPS = 0.4
_TILE_M = 8.0
_APART_M = 0.35  # at the start; bodies are less deep than broad
_TOGETHER_M = 1.0  # along and aside of a group's first, at the start
_TRIES = 200  # for a place where nobody stands


class Crowd:
    """All people of a scenario; none starts in a robot of ``robots`` [k, 3] x, y, radius in m.

    ``walkers`` has their places, speeds and ways, and can be written to between two steps.
    """

    def __init__(self, groups: Sequence[People], terrain: Terrain, robots: np.ndarray,
                 streams: RandomStreams) -> None:
        self._terrain = terrain
        self.walkers = _walkers([_group(i, group, terrain, robots, streams("people", i))
                                 for i, group in enumerate(groups)])
        self._last_m: np.ndarray | None = None

    @property
    def discs(self) -> np.ndarray:
        """[n, 3] x, y, radius in m, a new array."""
        places = self.walkers.places
        return np.column_stack((places, np.full(len(places), RADIUS_M)))

    @property
    def bodies(self) -> np.ndarray | None:
        """[n, 4] x, y, radius, height in m, a new array, read-only; None if there is nobody."""
        if not len(self.walkers.places):
            return None
        discs = self.discs
        bodies = np.column_stack((discs, np.full(len(discs), HEIGHT_M)))
        bodies.setflags(write=False)
        return bodies

    def advance(self, dt_s: float, others: np.ndarray, doors: np.ndarray) -> None:
        """Walk on for ``dt_s`` among ``others`` [k, 3] x, y, radius, robots and moving obstacles,
        and closed ``doors`` [d, 4]."""
        if not len(self.walkers.places):
            return
        before_m, self._last_m = self._last_m, others[:, :2]
        velocities = np.zeros((len(others), 2)) if before_m is None else \
            (others[:, :2] - before_m) / dt_s
        walls = self._terrain.walls
        barrier = kernels.Barrier(np.concatenate([walls, doors]), len(walls), self._tiles)
        self._walk(self.walkers, np.column_stack((others, velocities)), barrier, dt_s)

    @cached_property
    def _walk(self) -> Callable[..., None]:
        return compiled_function(kernels.walk)

    @cached_property
    def _tiles(self) -> TileIndex:
        return tile_index(self._terrain.walls, self._terrain.bounds, _TILE_M, kernels.REACH_M)


class _Group:
    """A group at its start: ``points`` [p, 2] and ``normals`` of its way, and of each person
    ``places``, ``offsets``, ``target``, ``step``, ``company``."""

    def __init__(self, points: np.ndarray, group: People, speeds_mps: np.ndarray) -> None:
        self.points, self.normals = points, _normals(points)
        self.closed = len(points) > 2 and bool((points[0] == points[-1]).all())
        self.yields, self.speeds_mps = group.gives_way, speeds_mps
        self.places: list[np.ndarray] = []
        self.offsets: list[float] = []
        self.target: list[int] = []
        self.step: list[int] = []
        self.company: list[tuple[int, int]] = []


def _group(i: int, group: People, terrain: Terrain, robots: np.ndarray,
           draws: np.random.Generator) -> _Group:
    """People at random places of their way, in random directions unless it is a ring. Raises
    ``InputError`` for a way that is not free, and for more people than it has room for."""
    what, points = f"environment.people.{i}", np.array(group.path_m, dtype=np.float64)
    steps_m = np.hypot(*np.diff(points, axis=0).T)
    if not (steps_m > 0.0).all():
        raise InputError(f"{what}.path: the same way point twice in a row")
    half_m = group.width_m / 2.0
    found = _Group(points, group, np.clip(
        draws.normal(WANTED_MPS, SPREAD_MPS, group.count), _SLOWEST_MPS, None))
    for side_m in dict.fromkeys((-half_m, 0.0, half_m)):
        _check_free(what, found.points + side_m * found.normals, terrain, group.width_m)
    ends_m = np.cumsum(steps_m)
    low_m, high_m = np.array([0.0, -half_m]), np.array([ends_m[-1], half_m])
    for size in _sizes(group.count, group.groups, draws):
        first = len(found.places)
        near_m, far_m = low_m, high_m  # along the way and aside, of the group's first
        for _ in range(size):
            at_m, place = _free_place(found, ends_m, near_m, far_m, robots, draws)
            if place is None:
                raise InputError(f"{what}.count: no room for {group.count} people; "
                                 f"{len(found.places)} have a place")
            if len(found.places) == first:
                back = not found.closed and bool(draws.integers(2))
                near_m = np.maximum(at_m - _TOGETHER_M, low_m)
                far_m = np.minimum(at_m + _TOGETHER_M, high_m)
                offset_m = at_m[1]
            leg = int(np.searchsorted(ends_m, at_m[0]))
            found.places.append(place)
            found.offsets.append(offset_m)
            found.target.append(leg if back else leg + 1)
            found.step.append(-1 if back else 1)
            found.company.append((first, first + size))
    return found


def _free_place(found: _Group, ends_m: np.ndarray, near_m: np.ndarray, far_m: np.ndarray,
                robots: np.ndarray, draws: np.random.Generator
                ) -> tuple[np.ndarray, np.ndarray | None]:
    """A point between ``near_m`` and ``far_m`` along the way and aside of it, and its place, where
    nobody stands; None: there is none."""
    begins_m = np.concatenate([[0.0], ends_m[:-1]])
    taken = np.array([*((*other, _APART_M - RADIUS_M) for other in found.places), *robots])
    for _ in range(_TRIES):
        at_m = np.array([draws.uniform(near, far)
                         for near, far in zip(near_m, far_m, strict=True)])
        leg = int(np.searchsorted(ends_m, at_m[0]))
        share = 1.0 - (ends_m[leg] - at_m[0]) / (ends_m[leg] - begins_m[leg])
        lines = found.points + at_m[1] * found.normals
        place = lines[leg] + share * (lines[leg + 1] - lines[leg])
        if not len(taken) or (np.hypot(*(taken[:, :2] - place).T) >= taken[:, 2] + RADIUS_M).all():
            return at_m, place
    return at_m, None


def _sizes(count: int, rate: float, draws: np.random.Generator) -> list[int]:
    """Sizes of groups of ``count`` people, by a zero-truncated Poisson distribution of ``rate``."""
    sizes: list[int] = []
    while (left := count - sum(sizes)) > 0:
        size = 1
        if rate:
            share = draws.uniform(0.0, math.expm1(rate))
            while (share := share - rate ** size / math.factorial(size)) > 0.0:
                size += 1
        sizes.append(min(size, left))
    return sizes


def _check_free(what: str, points: np.ndarray, terrain: Terrain, width_m: float) -> None:
    legs = np.concatenate([points[:-1], points[1:]], axis=1)
    clear_m = min(terrain.clearance(points, RADIUS_M).min(),
                  point_distance(terrain.walls.reshape(-1, 2), legs).min(initial=np.inf))
    if clear_m < RADIUS_M - TOUCH_M or len(crossing(terrain.walls, legs)):
        raise InputError(f"{what}.path: with a width of {LENGTH.format(width_m)} it crosses a wall "
                         f"or leaves the terrain, or comes closer to a wall than {RADIUS_M:g} m")


def _normals(points: np.ndarray) -> np.ndarray:
    """[p, 2] unit vectors to the left of the way at each point: halfway between its legs."""
    ways = np.diff(points, axis=0)
    ways /= np.hypot(*ways.T)[:, None]
    closed = len(points) > 2 and (points[0] == points[-1]).all()
    before = np.concatenate([ways[-1:] if closed else ways[:1], ways])
    after = np.concatenate([ways, ways[:1] if closed else ways[-1:]])
    mean = before + after
    length = np.hypot(*mean.T)[:, None]
    mean = np.where(length > 1e-9, mean / np.maximum(length, 1e-9), after)
    return np.column_stack((-mean[:, 1], mean[:, 0]))


def _walkers(groups: Sequence[_Group]) -> kernels.Walkers:
    """The arrays of all groups."""
    counts = [len(group.places) for group in groups]
    firsts = np.cumsum([0, *(len(group.points) for group in groups)])

    def each(values: Sequence[object], dtype: type) -> np.ndarray:
        return np.repeat(np.array(values, dtype=dtype), counts)

    def joined(lists: list[np.ndarray], shape: tuple[int, ...], dtype: type = float) -> np.ndarray:
        return np.ascontiguousarray(np.concatenate([np.zeros(shape, dtype), *lists]), dtype=dtype)

    first, last = each(firsts[:-1].tolist(), np.int64), each((firsts[1:] - 1).tolist(), np.int64)
    places = joined([np.array(group.places) for group in groups], (0, 2))
    return kernels.Walkers(
        places, np.zeros_like(places), joined([group.speeds_mps for group in groups], (0,)),
        RADIUS_M, joined([np.array(group.offsets) for group in groups], (0,)),
        first + joined([np.array(group.target) for group in groups], (0,), np.int64),
        joined([np.array(group.step) for group in groups], (0,), np.int64), first, last,
        each([group.closed for group in groups], bool),
        each([group.yields for group in groups], bool),
        joined([start + np.array(group.company) for start, group in zip(
            np.cumsum([0, *counts]), groups, strict=False)], (0, 2), np.int64),
        joined([group.points for group in groups], (0, 2)),
        joined([group.normals for group in groups], (0, 2)))
