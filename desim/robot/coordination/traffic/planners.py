"""Planners that decide to which cell each robot goes next.

No two go to one, and no two change places.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol

import numpy as np

from desim.ports import natural_key
from desim.robot.coordination.traffic.cells import Cell, CellGraph

_WINDOW = 16  # steps that are planned ahead (Silver 2005 has 8, 16 and 32)
_AGAIN = 8  # after so many of them all plan anew: half a window (Silver 2005)


class TrafficPlanner(Protocol):
    """Decides steps of all robots, which they make together."""

    def step(self, graph: CellGraph, at: Mapping[str, Cell], goals: Mapping[str, Cell]
             ) -> dict[str, Cell]:
        """The next cell of each robot: its own, or one beside. ``at`` and ``goals`` have the same
        names; a robot that wants nothing has its own cell for a goal."""


class Pibt:
    """Priority inheritance with backtracking (Okumura, Machida, Defago, Tamura 2022, algorithm 1).

    On a graph in which each edge is on a cycle, with fewer robots than cells, every robot gets to
    its goal (theorem 1): the one that waits longest always moves on, and pushes others aside. As
    in the authors' program, of those that wait equally long the one with the longest way is first,
    and chance decides between cells that are equally good: without it robots push each other
    aside for ever.
    """

    def __init__(self, stream: np.random.Generator) -> None:
        self._stream = stream
        self._waited: dict[str, int] = {}  # steps since it was at a goal
        self._ways: dict[str, tuple[Cell, int]] = {}  # its goal, and how far that was at first

    def step(self, graph: CellGraph, at: Mapping[str, Cell], goals: Mapping[str, Cell]
             ) -> dict[str, Cell]:
        """See ``TrafficPlanner``."""
        names = sorted(at, key=natural_key)
        for name in names:
            self._waited[name] = 0 if at[name] == goals[name] else self._waited.get(name, 0) + 1
            if self._ways.get(name, (None, 0))[0] != goals[name]:
                self._ways[name] = goals[name], graph.steps_to(goals[name]).get(at[name], 0)
        self._graph, self._at, self._goals = graph, at, goals
        self._chances = dict(zip(names, self._stream.random((len(names), 5)).tolist(),
                                 strict=True))
        self._holders = {cell: name for name, cell in at.items()}
        self._next: dict[str, Cell] = {}
        self._taken: set[Cell] = set()
        for name in sorted(names, key=lambda one: (-self._waited[one], -self._ways[one][1])):
            if name not in self._next:
                self._moves(name, None)
        return self._next

    def _moves(self, name: str, pusher: str | None) -> bool:
        """Give ``name`` a next cell. False: it has to stay, and its pusher goes elsewhere."""
        here, steps = self._at[name], self._graph.steps_to(self._goals[name])
        far = len(self._graph.edges)
        for _, _, _, cell in sorted(
                (steps.get(one, far), one in self._holders, chance, one) for one, chance in zip(
                    (*self._graph.edges[here], here), self._chances[name], strict=False)):
            if cell in self._taken or (pusher is not None and cell == self._at[pusher]):
                continue
            self._next[name] = cell
            self._taken.add(cell)
            holder = self._holders.get(cell)
            if holder is None or holder in self._next or self._moves(holder, name):
                return True
            self._taken.discard(cell)
            self._taken.add(self._at[holder])
        self._next[name] = here
        self._taken.add(here)
        return False


class Prioritized:
    """Cooperative A* with reservations of cells in time, over a window (WHCA*, Silver 2005).

    Robots plan one after another, each around the reservations of those before it. One that finds
    no way becomes the first, and all plan anew. After half a window all plan anew, too, and those
    that are farthest from their goals come first.
    """

    def __init__(self) -> None:
        self._paths: dict[str, list[Cell]] = {}
        self._wanted: Mapping[str, Cell] = {}
        self._made = 0

    def step(self, graph: CellGraph, at: Mapping[str, Cell], goals: Mapping[str, Cell]
             ) -> dict[str, Cell]:
        """See ``TrafficPlanner``."""
        follow = {name: path[self._made] for name, path in self._paths.items()}
        if self._made >= _AGAIN or follow != dict(at) or goals != self._wanted:
            far = len(graph.edges)
            order = sorted(sorted(at, key=natural_key), key=lambda name: -graph.steps_to(
                goals[name]).get(at[name], far))
            self._paths, self._made = paths(graph, at, goals, order), 0
            self._wanted = dict(goals)
        self._made += 1
        return {name: path[self._made] for name, path in self._paths.items()}


def paths(graph: CellGraph, at: Mapping[str, Cell], goals: Mapping[str, Cell],
          order: Sequence[str]) -> dict[str, list[Cell]]:
    """The cells of each robot at steps 0 to the window's end. If one has no way, with each of the
    robots first in turn, all stand."""
    order = list(order)
    for _ in range(len(order)):
        found: dict[str, list[Cell]] = {}
        for name in order:
            path = _path(graph, at[name], goals[name], found.values())
            if path is None:
                order.remove(name)
                order.insert(0, name)
                break
            found[name] = path
        else:
            return found
    return {name: [cell] * (_WINDOW + 1) for name, cell in at.items()}


def _path(graph: CellGraph, start: Cell, goal: Cell, reserved: Iterable[list[Cell]]
          ) -> list[Cell] | None:
    """The cheapest path over the window around ``reserved`` ones: a step costs 1 but at the goal,
    and what is left at the end costs its number of steps. None: there is none."""
    others = list(reserved)
    taken = [{path[k] for path in others} for k in range(_WINDOW + 1)]
    moves = [{(path[k], path[k + 1]) for path in others} for k in range(_WINDOW)]
    steps, far = graph.steps_to(goal), len(graph.edges)
    queue: list[tuple[int, int, int, Cell]] = [(steps.get(start, far), 0, 0, start)]
    before: dict[tuple[int, Cell], Cell | None] = {(0, start): None}
    while queue:
        _, late, cost, cell = heapq.heappop(queue)
        k = -late
        if k == _WINDOW:
            return _back(before, cell)
        for then in (*graph.edges[cell], cell):
            if (k + 1, then) in before or then in taken[k + 1] or (then, cell) in moves[k]:
                continue
            before[k + 1, then] = cell
            further = cost + (cell != goal or then != goal)
            heapq.heappush(queue, (further + steps.get(then, far), -(k + 1), further, then))
    return None


def _back(before: Mapping[tuple[int, Cell], Cell | None], last: Cell) -> list[Cell]:
    """The path that ends at ``last``."""
    path = [last]
    for k in range(_WINDOW, 0, -1):
        cell = before[k, path[-1]]
        assert cell is not None
        path.append(cell)
    return path[::-1]
