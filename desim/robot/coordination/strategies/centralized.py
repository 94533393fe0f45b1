"""A central coordinator: the base assigns frontiers to all robots, which obey (Burgard 2005)."""

import math
from typing import Literal

import numpy as np
from pydantic import Field
from scipy.optimize import linear_sum_assignment

from desim import ports
from desim.robot.coordination.assignment import NO_WAY_M, finite_costs_m
from desim.robot.coordination.strategies.nearest_frontier import nearest
from desim.units import Duration, Length, Period


class Centralized:
    """Robots drive where a host without a body sends them: it merges their maps and assigns
    frontiers to those without a task (Burgard, Moors, Stachniss, Schneider 2005, section III).

    The same class runs on the robots and on that host. Every ``period`` a robot reports its place
    and the drives that have ended; the base publishes the tasks of all robots. ``hungarian``
    minimizes the total length of all paths. ``greedy`` assigns the shortest path first. A frontier
    near a task is taken. A task is over when the drive has ended, or when no frontier is near it
    any more: then the robot in front gets the next frontier without a stop. Failsafe: a robot goes
    on alone as ``nearest_frontier`` when it has heard of no task, its own or another robot's, for
    ``failsafe_after``: the base is silent, or its map does not have what robots have seen. It does
    so until it hears of tasks again.
    """

    class Params(ports.Params):
        assignment: Literal["hungarian", "greedy"] = Field("hungarian", description=(
            "how the base solves it"))
        period_ns: Period = Field("1 s", description="of reports and tasks (as the team's state)")
        near_m: Length = Field("4 m", gt=0, description="a frontier within it of a task is taken")
        avoid_ns: Duration = Field("30 s", description=(
            "time for which nobody is sent where a drive ended (six periods of the exchange)"))
        failsafe_after_ns: Duration = Field("15 s", description=(
            "without any task of the base, for whomever: go on alone (15 periods)"))

    traits = ports.StrategyTraits(needs_coordinator=True)

    def __init__(self, params: Params) -> None:
        self._params = params
        # On a robot: when it last heard of a task; the places where drives ended since the last
        # report.
        self._tasks_ns: int | None = None
        self._ended: list[ports.Place] = []
        # At the base: each robot's place; its task, and since when; places to avoid, until when.
        self._at: dict[str, ports.Place] = {}
        self._tasks: dict[str, tuple[ports.Place, int]] = {}
        self._avoid: list[tuple[ports.Place, int]] = []

    def on_start(self, host: ports.StrategyContext) -> None:
        if host.has_body:
            host.advertise("report", queue=10)
            host.subscribe("tasks", self._on_tasks)
            host.every(self._params.period_ns, self._report)
        else:
            host.advertise("tasks")
            host.subscribe("report", self._on_report)
            host.every(self._params.period_ns, self._assign)

    # -------------------------------------------------------------------------------- a robot

    def choose(self, robot: ports.StrategyContext) -> ports.Frontier | None:
        return nearest(robot) if self._is_alone(robot) else None

    def on_goal(self, robot: ports.StrategyContext, place: ports.Place, end: ports.GoalEnd) -> None:
        if end is not ports.GoalEnd.REPLACED:
            self._ended.append(place)
            self._report(robot)

    def _is_alone(self, robot: ports.StrategyContext) -> bool:
        if self._tasks_ns is None:  # it waits from now on
            self._tasks_ns = robot.now_ns
        return robot.now_ns - self._tasks_ns >= self._params.failsafe_after_ns

    def _report(self, robot: ports.StrategyContext) -> None:
        if robot.pose is None:
            return
        robot.publish("report", {"at": robot.pose[:2], "goal": robot.goal, "ended": self._ended})
        self._ended = []
        if robot.goal is None and self._is_alone(robot):  # nothing else would make it move
            place = nearest(robot)
            if place is not None:
                robot.go(place)

    def _on_tasks(self, robot: ports.StrategyContext, tasks: ports.StrategyMessage) -> None:
        if tasks.content:
            self._tasks_ns = robot.now_ns
        task = tasks.content.get(robot.name)
        if task is not None and robot.pose is not None and not robot.go(ports.Place(*task)):
            self._ended.append(ports.Place(*task))  # by its own map it cannot be there

    # -------------------------------------------------------------------------------- the base

    def _on_report(self, base: ports.StrategyContext, report: ports.StrategyMessage) -> None:
        name, content = report.source, report.content
        self._at[name] = ports.Place(*content["at"])
        ended = [ports.Place(*place) for place in content["ended"]]
        self._avoid += [(place, base.now_ns + self._params.avoid_ns) for place in ended]
        task, since_ns = self._tasks.get(name, (None, 0))
        is_idle = content["goal"] is None and report.sent_ns > since_ns + self._params.period_ns
        if task in ended or is_idle:
            self._tasks.pop(name, None)

    def on_teammate(self, host: ports.StrategyContext, name: str, heard: bool) -> None:
        if not heard:  # its task goes to another robot
            self._tasks.pop(name, None)
            self._at.pop(name, None)

    def _assign(self, base: ports.StrategyContext) -> None:
        """End the tasks that are done, give tasks to robots without one, and publish all."""
        self._avoid = [one for one in self._avoid if one[1] > base.now_ns]
        frontiers = self._frontiers(base)
        self._tasks = {name: task for name, task in self._tasks.items()
                       if any(math.dist(task[0], one) < self._params.near_m for one in frontiers)}
        idle = sorted((name for name in self._at if name not in self._tasks),
                      key=ports.natural_key)
        places = [one for one in frontiers if not self._is_taken(one)]
        if idle and places:
            costs_m = finite_costs_m([base.path_lengths_m(places, self._at[name])
                                      for name in idle])
            solve = (linear_sum_assignment if self._params.assignment == "hungarian" else _greedy)
            for robot, place in zip(*solve(costs_m), strict=True):
                if costs_m[robot, place] < NO_WAY_M and not self._is_taken(places[place]):
                    self._tasks[idle[robot]] = places[place], base.now_ns
        tasks = {name: task for name, (task, _) in self._tasks.items()}
        base.show("assignment", (ports.Mark(*task, name) for name, task in tasks.items()))
        base.publish("tasks", tasks)

    def _frontiers(self, base: ports.StrategyContext) -> list[ports.Place]:
        """The frontiers, ordered by path length from the first robot that can reach any."""
        for name in sorted(self._at, key=ports.natural_key):
            found = base.frontiers(origin=self._at[name])
            if found:
                return [ports.Place(*one[:2]) for one in found]
        return []

    def _is_taken(self, place: tuple[float, ...]) -> bool:
        taken = [task for task, _ in self._tasks.values()] + [one for one, _ in self._avoid]
        return any(math.dist(place[:2], one) < self._params.near_m for one in taken)


def _greedy(costs: np.ndarray) -> tuple[list[int], list[int]]:
    """Rows and columns of the pairs of a greedy assignment, the cheapest pair first."""
    left, pairs = costs.copy(), []
    for _ in range(min(costs.shape)):
        row, column = divmod(int(left.argmin()), costs.shape[1])
        pairs.append((row, column))
        left[row, :] = left[:, column] = np.inf
    return [row for row, _ in pairs], [column for _, column in pairs]
