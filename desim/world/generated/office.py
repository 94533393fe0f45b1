"""Offices by binary space partitioning: corridors, and rooms along them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from desim.ports.terrain import Wall
from desim.scenario.schema.environment import Shape
from desim.scenario.schema.generated import Office
from desim.world.generated.walls import length, wall

CORNER_M = 0.3  # of wall between a door and the corner of its room, where there is space for it
LEAST_M = 1e-5  # of a piece of wall that is drawn: positions are to the micrometre

Span = tuple[float, float]  # from, to in m


class Wing(NamedTuple):
    """A part of the floor beside a corridor, which runs in the direction ``along`` at ``front``,
    the first or the last value of ``away``.

    ``turned``: along is y and away is x; otherwise along is x and away is y.
    """

    along: Span
    away: Span
    front: float
    turned: bool


def shape(plan: Office, rng: np.random.Generator) -> Shape:
    """The office. Each corridor begins at the one that was laid before it, and each room has a door
    to its corridor or to the room before it: so all are joined."""
    width, depth = plan.size_m
    x, y = (-width / 2, width / 2), (-depth / 2, depth / 2)
    # The first corridor runs along the longer side, as if from one outside.
    wings = [Wing(y, x, x[0], True) if width >= depth else Wing(x, y, y[0], False)]
    walls: list[Wall] = []
    while wings:
        wing = wings.pop()
        halves = _cut_by_corridor(wing, plan, rng)
        wings += halves
        if not halves:
            walls += _Rooms(wing, plan, rng).walls()
    return Shape(size=(length(width), length(depth)), walls=tuple(walls))


def _cut_by_corridor(wing: Wing, plan: Office, rng: np.random.Generator) -> list[Wing]:
    """The two wings beside a new corridor, which leads away from the old one; none where one row of
    rooms is enough or where there is no space for a corridor."""
    (start, end), least = wing.along, plan.room_m[0]
    space = end - start - 2 * least - plan.corridor_m
    if wing.away[1] - wing.away[0] <= plan.room_m[1] or space < 0:
        return []
    left = start + least + space * float(rng.random())
    right = left + plan.corridor_m
    return [Wing(wing.away, (start, left), left, not wing.turned),
            Wing(wing.away, (right, end), right, not wing.turned)]


class _Rooms:
    """The rooms of a wing: columns along the corridor, and in each of them rooms one behind the
    other, where they would be too deep."""

    def __init__(self, wing: Wing, plan: Office, rng: np.random.Generator) -> None:
        self._part, self._plan, self._rng = wing, plan, rng
        width, depth = plan.size_m
        self._edges = {False: (-depth / 2, depth / 2), True: (-width / 2, width / 2)}

    def walls(self) -> Iterator[Wall]:
        """The walls around the rooms and between them. What lies on the bounds is there already."""
        wing = self._part
        columns = self._cuts(*wing.along)
        for at in columns:
            if at not in self._edges[not wing.turned]:
                yield from self._wall(wing.away, at, not wing.turned, door=False)
        for column in pairwise(columns):
            for at in self._cuts(*wing.away):
                if at not in self._edges[wing.turned]:
                    yield from self._wall(column, at, wing.turned,
                                          door=at == wing.front or at not in wing.away)

    def _cuts(self, start: float, end: float) -> list[float]:
        """The places where rooms begin and end, by binary partitioning: none is longer than the
        largest, and none shorter than the least."""
        least, largest = self._plan.room_m
        if end - start <= largest:
            return [start, end]
        cut = float(self._rng.uniform(start + least, end - least))
        return [*self._cuts(start, cut), *self._cuts(cut, end)[1:]]

    def _wall(self, span: Span, at: float, turned: bool, door: bool) -> Iterator[Wall]:
        """A wall over ``span``, at ``at`` of the other direction; ``turned``: it runs along y."""
        start, end = span
        pieces = [span]
        if door:
            space = max(end - start - self._plan.door_m, 0.0)
            corner = min(CORNER_M, space / 2)
            opens = start + corner + (space - 2 * corner) * float(self._rng.random())
            pieces = [(start, opens), (opens + self._plan.door_m, end)]
        for low, high in pieces:
            if high - low > LEAST_M:
                ends = ((at, low), (at, high)) if turned else ((low, at), (high, at))
                yield wall(self._plan, *ends)
