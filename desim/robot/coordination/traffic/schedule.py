"""An action dependency graph of cells: who may enter one next (Hönig, Kiesel et al. 2019)."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Mapping
from typing import NamedTuple

from desim.ports import Place
from desim.robot.coordination.traffic.cells import Cell


class CellVisit(NamedTuple):
    """A robot's stop in ``cell``, at ``place``."""

    cell: Cell
    place: Place


class Schedule:
    """The planned visits of each robot in order, and of each cell in order.

    A robot may enter a cell when all whose visits to it were planned before have left it. The
    robots of a circle, each of which waits for the next, enter their cells together. So robots
    keep to the plan's order, not to its times.
    """

    def __init__(self) -> None:
        # By robot: the visit where it is, the one that it was granted, those planned behind it.
        self._at: dict[str, CellVisit] = {}
        self._granted: dict[str, CellVisit] = {}
        self._planned: dict[str, deque[CellVisit]] = {}
        # By cell: the robots whose visits are not over.
        self._visitors: defaultdict[Cell, deque[str]] = defaultdict(deque)

    @property
    def granted(self) -> Mapping[str, CellVisit]:
        """By robot, the last visit that it was granted."""
        return self._granted

    def under_way(self) -> dict[str, CellVisit]:
        """The granted visits to which robots are on their way, by what they reported."""
        return {name: visit for name, visit in self._granted.items()
                if self._at.get(name) != visit}

    def ends(self) -> dict[str, CellVisit]:
        """The last planned visit of each robot."""
        return {name: planned[-1] if planned else self._granted[name]
                for name, planned in self._planned.items()}

    def steps_ahead(self, name: str) -> int:
        """The number of planned visits to which ``name`` has not come."""
        return len(self._planned[name]) + (self._at.get(name) != self._granted[name])

    def start(self, name: str, visit: CellVisit) -> None:
        """Grant ``name`` a visit, with none planned behind it."""
        self._granted[name] = visit
        self._planned[name] = deque()
        self._visitors[visit.cell].append(name)

    def resume(self, name: str, at: CellVisit, granted: CellVisit) -> None:
        """Take up a robot that is at one visit, and may be on its way to the next."""
        self._at[name] = at
        for visit in dict.fromkeys((at, granted)):
            self.start(name, visit)

    def plan(self, name: str, visit: CellVisit) -> None:
        """Add a visit behind those planned for ``name``."""
        self._planned[name].append(visit)
        self._visitors[visit.cell].append(name)

    def arrive(self, name: str, place: Place) -> bool:
        """Whether ``name``, which reports that it stands at ``place``, has left a cell by it."""
        visit, before = self._granted[name], self._at.get(name)
        if place != visit.place or visit == before:
            return False
        self._at[name] = visit
        if before is not None:
            self._visitors[before.cell].remove(name)
        return True

    def grant(self) -> list[str]:
        """Grant the next visits that may begin, and give the names of their robots."""
        waiting = {name: planned[0].cell for name, planned in self._planned.items()
                   if planned and self._at.get(name) == self._granted[name]}
        free: dict[str, None] = {}
        for name, cell in waiting.items():
            if self._visitors[cell][0] == name:
                free[name] = None
            elif name not in free:
                free.update(dict.fromkeys(self._circle(name, waiting)))
        for name in free:
            self._granted[name] = self._planned[name].popleft()
        return list(free)

    def _circle(self, name: str, waiting: Mapping[str, Cell]) -> list[str]:
        """The robots of the circle in which ``name`` waits for a cell, none if it is in none."""
        circle = [name]
        while True:
            cell = waiting[circle[-1]]
            holder, *then = list(self._visitors[cell])[:2]
            if then != circle[-1:] or holder not in waiting or self._at[holder].cell != cell:
                return []
            if holder in circle:
                return circle if holder == name else []
            circle.append(holder)
