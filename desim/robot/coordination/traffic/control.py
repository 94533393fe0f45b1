"""Traffic over the network: a host plans steps on cells, robots move to the cells they are granted.
"""

from __future__ import annotations

import math

from pydantic import Field

from desim import ports
from desim.ports.tasks import Journeys
from desim.robot.coordination.traffic.cells import Cell, CellGraph, cells_of
from desim.robot.coordination.traffic.planners import TrafficPlanner
from desim.units import NS_PER_S, Length

_PERIOD_NS = NS_PER_S // 2  # of reports and grants; each holds all that counts, so losses heal


class TrafficParams(ports.Params):
    """The parameters of all strategies that plan on cells."""

    cell_m: Length = Field("2 m", gt=0, description=(
        "the width of a cell; two robots side by side have room (an example)"))


class TrafficControl:
    """Base of strategies whose robots ask a host without a body for each cell.

    Robots report the cell where they stand, and drive to the one that they are granted; without a
    grant they stand. The host grants a step of the plan when the cell is free by the reports:
    nobody stands in it or has been granted it. The robots of a circle, each of which waits for the
    next, are granted their cells together. The next step is planned when all have reported this
    one. Failsafe: a robot that hears nothing stands in its cell, and all others wait for it.
    """

    traits = ports.StrategyTraits(needs=Journeys, needs_coordinator=True)

    def __init__(self, planner: TrafficPlanner, params: TrafficParams) -> None:
        self._planner, self._cell_m = planner, params.cell_m
        self._graph: CellGraph | None = None
        # On a robot: the place that it was granted and has come to.
        self._stands: ports.Place | None = None
        # At the host: the places and cells where robots stand, the cells that they are granted,
        # those of the plan, and the number of goals that each has reached.
        self._places: dict[str, ports.Place] = {}
        self._at: dict[str, Cell] = {}
        self._granted: dict[str, Cell] = {}
        self._planned: dict[str, Cell] = {}
        self._reached: dict[str, int] = {}

    def on_start(self, host: ports.StrategyContext) -> None:
        if host.has_body:
            host.advertise("stands")
            host.subscribe("grants", self._on_grants)
            host.every(_PERIOD_NS, self._report)
        else:
            host.advertise("grants")
            host.subscribe("stands", self._on_stands)
            host.every(_PERIOD_NS, self._grant)

    # -------------------------------------------------------------------------------- a robot

    def choose(self, robot: ports.StrategyContext) -> ports.Place | None:
        """Only grants move it."""
        return None

    def on_goal(self, robot: ports.StrategyContext, place: ports.Place, end: ports.GoalEnd) -> None:
        if end is ports.GoalEnd.REACHED:
            self._stands = place
            self._report(robot)

    def _report(self, robot: ports.StrategyContext) -> None:
        if robot.pose is None:
            return
        if self._stands is None and robot.goal is None:  # at its start
            robot.publish("stands", {"start": [round(value, 2) for value in robot.pose[:2]]})
        elif self._stands is not None:
            robot.publish("stands", {"at": list(self._stands)})

    def _on_grants(self, robot: ports.StrategyContext, grants: ports.StrategyMessage) -> None:
        granted = grants.content.get(robot.name)
        if granted is not None and robot.pose is not None:
            place = ports.Place(*granted)
            if place not in (self._stands, robot.goal):
                robot.go(place)

    # --------------------------------------------------------------------------------- the host

    def _on_stands(self, host: ports.StrategyContext, message: ports.StrategyMessage) -> None:
        name, content = message.source, message.content
        graph = self._cells(host)
        if graph is None or name not in host.task.goals:
            return
        if "at" in content:
            cell = graph.nearest(content["at"])
            if cell == self._granted.get(name):
                self._at[name], self._places[name] = cell, ports.Place(*content["at"])
        elif name not in self._granted:
            self._granted[name] = graph.nearest_but(content["start"], self._granted.values())
        self._plan_on(host)

    def _cells(self, host: ports.StrategyContext) -> CellGraph | None:
        if self._graph is None and host.known_m2() > 0:
            self._graph = cells_of(host.costmap(), host.grid, self._cell_m)
        return self._graph

    def _plan_on(self, host: ports.StrategyContext) -> None:
        """Plan the next step if all robots have made this one; grant what is free."""
        names = host.task.goals
        if len(self._at) < len(names):
            return  # not all have come to their first cells
        if all(self._at[name] == self._planned.get(name, self._at[name]) for name in names):
            goals = {name: self._goal(host, name) for name in names}
            before = dict(self._planned)
            assert self._graph is not None
            self._planned = self._planner.step(self._graph, self._at, goals)
            if self._planned == before and self._planned == self._at:
                return
        if self._free_cells():
            host.publish("grants", self._grants(host))

    def _goal(self, host: ports.StrategyContext, name: str) -> Cell:
        """The cell of the robot's present goal; its last one when it has been at all."""
        goals, graph = host.task.goals[name], self._graph
        assert graph is not None
        reached = self._reached.setdefault(name, 0)
        is_there = math.dist(self._places[name], goals[reached]) <= host.task.within_m
        if is_there and reached + 1 < len(goals):
            self._reached[name] = reached = reached + 1
        return graph.nearest(goals[reached])

    def _free_cells(self) -> bool:
        """Grant planned cells that are free, and those of circles. Whether any was granted."""
        waiting = {name: cell for name, cell in self._planned.items()
                   if self._granted[name] != cell and self._at[name] == self._granted[name]}
        taken = {*self._at.values(), *self._granted.values()}
        free = [name for name, cell in waiting.items() if cell not in taken]
        holders = {self._at[name]: name for name in waiting}
        for name in waiting:
            if name not in free:
                ring = _ring(name, waiting, holders)
                free += [one for one in ring if one not in free]
        for name in free:
            self._granted[name] = waiting[name]
        return bool(free)

    def _grant(self, host: ports.StrategyContext) -> None:
        if self._granted and self._graph is not None:
            host.show("grants", (ports.Mark(*self._graph.centre(cell), name)
                                 for name, cell in self._granted.items()))
            host.publish("grants", self._grants(host))

    def _grants(self, host: ports.StrategyContext) -> dict[str, list[float]]:
        """The places of the cells that are granted: their centres, or the goal that lies there."""
        assert self._graph is not None
        places = {}
        for name, cell in self._granted.items():
            goal = host.task.goals[name][self._reached.get(name, 0)]
            places[name] = list(goal if self._graph.nearest(goal) == cell
                                else self._graph.centre(cell))
        return places


def _ring(name: str, waiting: dict[str, Cell], holders: dict[Cell, str]) -> list[str]:
    """The robots of the circle in which ``name`` waits for a cell, none if it is in none."""
    ring, one = [name], holders.get(waiting[name])
    while one is not None and one != name and len(ring) <= len(waiting) < math.inf:
        ring.append(one)
        one = holders.get(waiting[one])
    return ring if one == name else []
