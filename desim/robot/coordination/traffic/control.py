"""Traffic over the network: a host plans steps on cells, robots move to the cells they are granted.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping

from pydantic import Field

from desim import ports
from desim.robot.coordination.traffic.cells import Cell, CellGraph, cells_of
from desim.robot.coordination.traffic.planners import TrafficPlanner
from desim.robot.coordination.traffic.schedule import CellVisit, Schedule
from desim.units import NS_PER_S, Length

_PERIOD_NS = NS_PER_S // 2  # of reports and grants, which are repeated, so losses heal


class TrafficParams(ports.Params):
    """The parameters of all strategies that plan on cells."""

    cell_m: Length = Field("2 m", gt=0, description=(
        "the width of a cell; two robots side by side have room (an example)"))
    ahead: int = Field(10, ge=1, description=(
        "the number of steps that are planned ahead of the robot that is farthest behind; with 1 "
        "all make a step before the next one is planned"))


class TrafficControl(ABC):
    """Base of strategies whose robots ask a host without a body for each cell.

    Robots report the cell where they stand, and drive to the one that they are granted; without a
    grant they stand. The host plans steps of all robots ``ahead`` of their reports, and grants the
    cells in the order of the plan. Each robot hears its grants on a topic of its own, as VDA 5050
    has it for orders. Failsafe: a robot that hears nothing stands in its cell, and the others come
    no further than ``ahead`` steps. A host that has started again asks robots where they stand,
    where they were let go, and for which goal, and plans on from there.
    """

    def __init__(self, params: TrafficParams) -> None:
        self._cell_m, self._ahead = params.cell_m, params.ahead
        self._graph: CellGraph | None = None
        self._stands: ports.Place | None = None  # on a robot: where it was granted and has come to
        self._schedule = Schedule()  # at the host

    @abstractmethod
    def planner(self, host: ports.StrategyContext) -> TrafficPlanner:
        """The one that plans on ``host``."""

    @abstractmethod
    def robots(self, host: ports.StrategyContext) -> Collection[str]:
        """The names of the robots that it plans for."""

    def hosts(self, robot: ports.StrategyContext) -> list[str] | None:
        """The names of those that may plan, None: of any in the team."""
        return None

    @abstractmethod
    def goal(self, host: ports.StrategyContext, name: str, place: ports.Place | None = None
             ) -> ports.Place | None:
        """The goal of a robot that is at ``place`` (None: on its way), None if it wants nothing."""

    @abstractmethod
    def says(self, robot: ports.StrategyContext, anew: bool) -> dict[str, object]:
        """The content of a robot's report beside its place; ``anew``: to a host that asked."""

    @abstractmethod
    def learn(self, name: str, content: Mapping[str, object]) -> None:
        """Take in, at the host, what a robot said."""

    def on_start(self, host: ports.StrategyContext) -> None:
        if host.has_body:
            host.advertise("stands")
            host.subscribe(f"grants/{host.name}", self._on_grant, sources=self.hosts(host))
            host.every(_PERIOD_NS, self._report)
        else:
            self._planner = self.planner(host)
            for name in self.robots(host):
                host.advertise(f"grants/{name}")
            host.subscribe("stands", self._on_stands)
            host.every(_PERIOD_NS, self._repeat)

    # -------------------------------------------------------------------------------- a robot

    def choose(self, robot: ports.StrategyContext) -> ports.Place | None:
        """Only grants move it."""
        return None

    def on_goal(self, robot: ports.StrategyContext, place: ports.Place, end: ports.GoalEnd) -> None:
        if end is ports.GoalEnd.REACHED:
            self._stands = place
            self.goal(robot, robot.name, place)
            self._report(robot)

    def _report(self, robot: ports.StrategyContext) -> None:
        if robot.pose is None:
            return
        if self._stands is None and robot.goal is None:  # at its start
            robot.publish("stands", {"start": [round(value, 2) for value in robot.pose[:2]]})
        elif self._stands is not None:
            robot.publish("stands", {"at": list(self._stands), **self.says(robot, False)})

    def _on_grant(self, robot: ports.StrategyContext, grant: ports.StrategyMessage) -> None:
        to = grant.content["to"]
        if to is None and self._stands is not None:  # the host does not know
            robot.publish("stands", {"at": self._stands, "to": robot.goal or self._stands,
                                     **self.says(robot, True)})
        elif (to is not None and robot.pose is not None
              and ports.Place(*to) not in (self._stands, robot.goal)):
            robot.go(ports.Place(*to))

    # --------------------------------------------------------------------------------- the host

    def _on_stands(self, host: ports.StrategyContext, message: ports.StrategyMessage) -> None:
        name, content = message.source, message.content
        graph = self._cells(host)
        if graph is None or name not in self.robots(host):
            return
        self.learn(name, content)
        granted = self._schedule.granted
        if name in granted:
            if "at" in content and self._schedule.arrive(name, ports.Place(*content["at"])):
                self._go_on(host, graph)
        elif "to" in content:
            at, to = (ports.Place(*content[key]) for key in ("at", "to"))
            self._schedule.resume(name, CellVisit(graph.nearest(at), at),
                                  CellVisit(graph.nearest(to), to))
        elif "at" in content:
            host.publish(f"grants/{name}", {"to": None})
        else:
            taken = [visit.cell for visit in granted.values()]
            cell = graph.nearest_but(content["start"], taken)
            self._schedule.start(name, self._visit(host, graph, name, cell))
            self._announce(host, name)

    def _cells(self, host: ports.StrategyContext) -> CellGraph | None:
        if self._graph is None and host.known_m2() > 0:
            self._graph = cells_of(host.costmap(), host.grid, self._cell_m)
        return self._graph

    def _go_on(self, host: ports.StrategyContext, graph: CellGraph) -> None:
        """Plan steps as far ahead as is allowed, and grant the cells that are free."""
        names = self.robots(host)
        if len(self._schedule.granted) == len(names):
            while (max(map(self._schedule.steps_ahead, names)) < self._ahead
                   and self._plan_step(host, graph)):
                pass
        for name in self._schedule.grant():
            self._announce(host, name)

    def _plan_step(self, host: ports.StrategyContext, graph: CellGraph) -> bool:
        """Plan one step of all robots. Whether any of them moves by it."""
        ends = self._schedule.ends()
        at = {name: visit.cell for name, visit in ends.items()}
        places = {name: self.goal(host, name, visit.place) for name, visit in ends.items()}
        goals = {name: at[name] if place is None else graph.nearest(place)
                 for name, place in places.items()}
        moves = False
        for name, cell in self._planner.step(graph, at, goals).items():
            stays = cell == at[name] and places[name] is None
            visit = ends[name] if stays else self._visit(host, graph, name, cell)
            if visit != ends[name]:
                self._schedule.plan(name, visit)
                moves = True
        return moves

    def _visit(self, host: ports.StrategyContext, graph: CellGraph, name: str, cell: Cell
               ) -> CellVisit:
        """A visit of the cell's centre, or of the goal that lies there."""
        goal = self.goal(host, name)
        is_there = goal is not None and graph.nearest(goal) == cell
        return CellVisit(cell, goal if goal is not None and is_there else graph.centre(cell))

    def _announce(self, host: ports.StrategyContext, name: str) -> None:
        host.publish(f"grants/{name}", {"to": list(self._schedule.granted[name].place)})

    def _repeat(self, host: ports.StrategyContext) -> None:
        if self._graph is None:
            return
        host.show("grants", (ports.Mark(*self._graph.centre(visit.cell), name)
                             for name, visit in self._schedule.granted.items()))
        for name in self._schedule.under_way():
            self._announce(host, name)
        self._go_on(host, self._graph)
