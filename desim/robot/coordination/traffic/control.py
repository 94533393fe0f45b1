"""Traffic over the network: a host plans steps on cells, robots move to the cells they are granted.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from pydantic import Field

from desim import ports
from desim.ports.tasks import Journeys
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

    traits = ports.StrategyTraits(needs=Journeys, needs_coordinator=True)

    def __init__(self, params: TrafficParams) -> None:
        self._cell_m, self._ahead = params.cell_m, params.ahead
        self._graph: CellGraph | None = None
        self._stands: ports.Place | None = None  # on a robot: where it was granted and has come to
        self._schedule = Schedule()  # at the host
        # The number of goals that robots have reached, at the host: by the end of what is planned.
        self._reached: dict[str, int] = {}

    @abstractmethod
    def planner(self, host: ports.StrategyContext) -> TrafficPlanner:
        """The one that plans on ``host``."""

    def on_start(self, host: ports.StrategyContext) -> None:
        if host.has_body:
            host.advertise("stands")
            hosts = [name for name in host.team if name not in host.task.goals]
            host.subscribe(f"grants/{host.name}", self._on_grant, sources=hosts)
            host.every(_PERIOD_NS, self._report)
        else:
            self._planner = self.planner(host)
            for name in host.task.goals:
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
            self._goal(robot, robot.name, place)
            self._report(robot)

    def _report(self, robot: ports.StrategyContext) -> None:
        if robot.pose is None:
            return
        if self._stands is None and robot.goal is None:  # at its start
            robot.publish("stands", {"start": [round(value, 2) for value in robot.pose[:2]]})
        elif self._stands is not None:
            robot.publish("stands", {"at": list(self._stands)})

    def _on_grant(self, robot: ports.StrategyContext, grant: ports.StrategyMessage) -> None:
        to = grant.content["to"]
        if to is None and self._stands is not None:  # the host does not know
            robot.publish("stands", {"at": self._stands, "to": robot.goal or self._stands,
                                     "reached": self._reached[robot.name]})
        elif (to is not None and robot.pose is not None
              and ports.Place(*to) not in (self._stands, robot.goal)):
            robot.go(ports.Place(*to))

    # --------------------------------------------------------------------------------- the host

    def _on_stands(self, host: ports.StrategyContext, message: ports.StrategyMessage) -> None:
        name, content = message.source, message.content
        graph = self._cells(host)
        if graph is None or name not in host.task.goals:
            return
        granted = self._schedule.granted
        if name in granted:
            if "at" in content and self._schedule.arrive(name, ports.Place(*content["at"])):
                self._go_on(host, graph)
        elif "to" in content:
            at, to = (ports.Place(*content[key]) for key in ("at", "to"))
            self._reached[name] = content["reached"]
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
        names = host.task.goals
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
        goals = {name: graph.nearest(self._goal(host, name, visit.place))
                 for name, visit in ends.items()}
        moves = False
        for name, cell in self._planner.step(graph, at, goals).items():
            visit = self._visit(host, graph, name, cell)
            if visit != ends[name]:
                self._schedule.plan(name, visit)
                moves = True
        return moves

    def _goal(self, host: ports.StrategyContext, name: str, place: ports.Place) -> ports.Place:
        """The goal of a robot that is at ``place``: the last one if it was at all."""
        goals, reached = host.task.goals[name], self._reached.setdefault(name, 0)
        if place == goals[reached] and reached + 1 < len(goals):
            self._reached[name] = reached = reached + 1
        return goals[reached]

    def _visit(self, host: ports.StrategyContext, graph: CellGraph, name: str, cell: Cell
               ) -> CellVisit:
        """A visit of the cell's centre, or of the goal that lies there."""
        goal = host.task.goals[name][self._reached.get(name, 0)]
        return CellVisit(cell, goal if graph.nearest(goal) == cell else graph.centre(cell))

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
